#include "server/pipeline/rate_limiter.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {

void RateLimiter::Fill(Bucket& bucket, Timestamp now_ns) const {
  const double passed_s = Seconds(std::max<Timestamp>(0, now_ns - bucket.filled_ns));
  bucket.tokens = std::min(limit_.burst, bucket.tokens + passed_s * limit_.per_s);
  bucket.filled_ns = now_ns;
}

RateLimiter::Bucket& RateLimiter::BucketOf(absl::string_view key, Timestamp now_ns) {
  if (const auto at = buckets_.find(key); at != buckets_.end()) return at->second;
  if (buckets_.size() >= max_keys_) {
    // A full bucket says no more than none.
    absl::erase_if(buckets_, [&](auto& entry) {
      Fill(entry.second, now_ns);
      return entry.second.tokens >= limit_.burst;
    });
  }
  if (buckets_.size() >= max_keys_) key = "";
  return buckets_.try_emplace(std::string(key), Bucket{limit_.burst, now_ns}).first->second;
}

std::optional<Timestamp> RateLimiter::Take(absl::string_view key, Timestamp now_ns, double amount) {
  if (limit_.per_s <= 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  Bucket& bucket = BucketOf(key, now_ns);
  Fill(bucket, now_ns);
  const double needed = std::min(amount, limit_.burst);
  if (bucket.tokens >= needed) {
    bucket.tokens -= amount;
    return std::nullopt;
  }
  return static_cast<Timestamp>(std::ceil(1e9 * (needed - bucket.tokens) / limit_.per_s));
}

std::size_t RateLimiter::size() const {
  const std::lock_guard lock(mutex_);
  return buckets_.size();
}

}  // namespace saccade
