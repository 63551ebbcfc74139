#include "server/rpc/status.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>

#include <atomic>
#include <optional>

#include "server/pipeline/busy.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

void AppendVarint(std::uint64_t value, std::string& out) {
  while (value >= 0x80) {
    out.push_back(static_cast<char>(value | 0x80));
    value >>= 7;
  }
  out.push_back(static_cast<char>(value));
}

// A length-delimited field of the protobuf wire format.
std::string Field(unsigned number, const std::string& payload) {
  std::string out;
  AppendVarint(number << 3 | 2u, out);
  AppendVarint(payload.size(), out);
  return out + payload;
}

// google.rpc.Status with one detail; those messages are not in Debian.
std::string Details(const absl::Status& status, const char* type, const std::string& detail) {
  const std::string any =
      Field(1, absl::StrCat("type.googleapis.com/google.rpc.", type)) + Field(2, detail);
  std::string code;
  AppendVarint(1u << 3, code);
  AppendVarint(static_cast<std::uint64_t>(status.raw_code()), code);
  return code + Field(2, std::string(status.message())) + Field(3, any);
}

// A google.rpc.BadRequest with one FieldViolation.
std::string BadRequest(const std::string& field, const std::string& description) {
  return Field(1, Field(1, field) + Field(2, description));
}

}  // namespace

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const auto code = static_cast<grpc::StatusCode>(status.raw_code());
  const std::string message(status.message());
  if (const std::optional<std::string> retry = RetryInfoOf(status)) {
    return {code, message, Details(status, "RetryInfo", *retry)};
  }
  const std::size_t colon = message.find(": ");
  if (!absl::IsInvalidArgument(status) || colon == std::string::npos) return {code, message};
  return {code, message,
          Details(status, "BadRequest",
                  BadRequest(message.substr(0, colon), message.substr(colon + 2)))};
}

namespace {

// Of a flood one line a second is enough: how many that came too often have no line of their own.
bool IsWorthALine(const absl::Status& status, std::uint64_t& unsaid) {
  static std::atomic<std::uint64_t> refused = 0;
  static std::atomic<Timestamp> said_ns = 0;
  if (!RetryInfoOf(status)) return true;
  const Timestamp now_ns = MonotonicNow();
  Timestamp last_ns = said_ns;
  const bool due = now_ns - last_ns >= 1'000'000'000;
  if (due && said_ns.compare_exchange_strong(last_ns, now_ns)) {
    unsaid = refused.exchange(0);
    return true;
  }
  ++refused;
  return false;
}

// "MapService/Get" is "Map.Get", as two services have one; of the others the method's own name.
std::string LogName(absl::string_view method) {
  const bool map = absl::ConsumePrefix(&method, "MapService/");
  return absl::StrCat(map ? "Map." : "", Printable(method.substr(method.find('/') + 1)));
}

}  // namespace

void Audit(const char* method, const std::string& participant_id, const absl::Status& status) {
  std::uint64_t unsaid = 0;
  if (!IsWorthALine(status, unsaid)) return;
  const std::string time =
      absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", absl::Now(), absl::UTCTimeZone());
  Log(absl::StrCat(time, " rpc ", LogName(method),
                   " participant=", Printable(participant_id.substr(0, 36)), " ",
                   status.ok() ? "ok" : Printable(status.ToString()),
                   unsaid == 0 ? "" : absl::StrCat(" (and ", unsaid, " more)")));
}

}  // namespace saccade
