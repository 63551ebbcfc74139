#include "server/pipeline/busy.hpp"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

namespace saccade {
namespace {

constexpr char kRetryInfo[] = "type.googleapis.com/google.rpc.RetryInfo";
constexpr char kRetryAfter[] = "saccade/retry_after_ns";  // the same for ourselves
constexpr Timestamp kSecond = 1'000'000'000;

void AppendVarint(std::uint64_t value, std::string& out) {
  while (value >= 0x80) {
    out.push_back(static_cast<char>(value | 0x80));
    value >>= 7;
  }
  out.push_back(static_cast<char>(value));
}

// A RetryInfo { retry_delay = 1: Duration { seconds = 1, nanos = 2 } }; not in Debian.
std::string EncodeRetryInfo(Timestamp after_ns) {
  std::string duration;
  AppendVarint(1u << 3, duration);
  AppendVarint(static_cast<std::uint64_t>(after_ns / kSecond), duration);
  AppendVarint(2u << 3, duration);
  AppendVarint(static_cast<std::uint64_t>(after_ns % kSecond), duration);
  std::string info;
  AppendVarint(1u << 3 | 2u, info);
  AppendVarint(duration.size(), info);
  return info + duration;
}

}  // namespace

absl::Status BusyError(absl::string_view message, Timestamp retry_after_ns) {
  const Timestamp after_ns = std::max<Timestamp>(retry_after_ns, 1'000'000);
  absl::Status status = absl::ResourceExhaustedError(
      absl::StrFormat("%s: try again in %.1f s", message, std::max(0.1, Seconds(after_ns))));
  status.SetPayload(kRetryAfter, absl::Cord(absl::StrCat(after_ns)));
  status.SetPayload(kRetryInfo, absl::Cord(EncodeRetryInfo(after_ns)));
  return status;
}

Timestamp RetryAfterOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kRetryAfter);
  Timestamp after_ns = 0;
  return payload && absl::SimpleAtoi(std::string(*payload), &after_ns) ? after_ns : 0;
}

std::optional<std::string> RetryInfoOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kRetryInfo);
  if (!payload) return std::nullopt;
  return std::string(*payload);
}

}  // namespace saccade
