#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/strings/string_view.h>

#include <mutex>
#include <optional>
#include <string>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// How often something may be done.
struct RateLimit {
  double per_s = 0;  // for long; 0: no limit
  double burst = 1;  // at once, after a rest
};

/// A token bucket for each of a bounded number of keys (peers, sessions). Thread safe.
class RateLimiter {
 public:
  /// Above `max_keys` keys at a time the further ones share a bucket.
  explicit RateLimiter(const RateLimit& limit, std::size_t max_keys = 4096)
      : limit_(limit), max_keys_(max_keys) {}

  /// Takes `amount`. Nothing: granted; else how long until there is so much [ns]. More than a burst
  /// is granted to a full bucket, which then has debts.
  std::optional<Timestamp> Take(absl::string_view key, Timestamp now_ns, double amount = 1);

  std::size_t size() const;

 private:
  struct Bucket {
    double tokens = 0;
    Timestamp filled_ns = 0;
  };
  void Fill(Bucket& bucket, Timestamp now_ns) const;
  Bucket& BucketOf(absl::string_view key, Timestamp now_ns);

  const RateLimit limit_;
  const std::size_t max_keys_;
  mutable std::mutex mutex_;
  absl::flat_hash_map<std::string, Bucket> buckets_;
};

}  // namespace saccade
