#include "server/rpc/status.hpp"

#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>

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

// google.rpc.Status with one google.rpc.BadRequest.FieldViolation; those messages are not in
// Debian.
std::string BadRequestDetails(const std::string& field, const std::string& description,
                              const std::string& message) {
  const std::string violation = Field(1, field) + Field(2, description);
  const std::string bad_request = Field(1, violation);
  const std::string any =
      Field(1, "type.googleapis.com/google.rpc.BadRequest") + Field(2, bad_request);
  std::string code;
  AppendVarint(1u << 3, code);
  AppendVarint(static_cast<std::uint64_t>(absl::StatusCode::kInvalidArgument), code);
  return code + Field(2, message) + Field(3, any);
}

}  // namespace

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const auto code = static_cast<grpc::StatusCode>(status.raw_code());
  const std::string message(status.message());
  const std::size_t colon = message.find(": ");
  if (!absl::IsInvalidArgument(status) || colon == std::string::npos) return {code, message};
  return {code, message,
          BadRequestDetails(message.substr(0, colon), message.substr(colon + 2), message)};
}

void Audit(const char* method, const std::string& session_id, const absl::Status& status) {
  const std::string time =
      absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", absl::Now(), absl::UTCTimeZone());
  Log(absl::StrCat(time, " rpc ", Printable(method),
                   " session=", Printable(session_id.substr(0, 36)), " ",
                   status.ok() ? "ok" : Printable(status.ToString())));
}

}  // namespace saccade
