#include "server/gateway/grpc_web.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace saccade {
namespace {

constexpr std::size_t kFrameHead = 5;
constexpr unsigned char kCompressed = 0x01;
constexpr unsigned char kTrailers = 0x80;

std::string Frame(unsigned char flags, absl::string_view payload, GrpcWebFormat format) {
  const auto size = static_cast<std::uint32_t>(payload.size());
  std::string frame;
  frame.reserve(kFrameHead + payload.size());
  frame.push_back(static_cast<char>(flags));
  for (int shift = 24; shift >= 0; shift -= 8) frame.push_back(static_cast<char>(size >> shift));
  absl::StrAppend(&frame, payload);
  return format == GrpcWebFormat::kText ? absl::Base64Escape(frame) : frame;
}

// Percent-encodes as gRPC does for grpc-message: what is not printable ASCII, and '%'.
std::string PercentEncode(absl::string_view text) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string out;
  for (const unsigned char c : text) {
    if (c >= 0x20 && c < 0x7f && c != '%') {
      out.push_back(static_cast<char>(c));
    } else {
      out.append({'%', kHex[c >> 4], kHex[c & 15]});
    }
  }
  return out;
}

// base64 that may be several padded pieces one after the other, as gRPC-Web allows.
absl::StatusOr<std::string> DecodeText(absl::string_view body) {
  std::string out;
  while (!body.empty()) {
    const std::size_t padding = body.find('=');
    std::size_t end = body.size();
    if (padding != absl::string_view::npos)
      end = std::min(body.find_first_not_of('=', padding), end);
    std::string piece;
    if (!absl::Base64Unescape(body.substr(0, end), &piece)) {
      return absl::InvalidArgumentError("request body: not base64; send grpc-web-text as base64");
    }
    out += piece;
    body.remove_prefix(end);
  }
  return out;
}

bool IsIdentifier(absl::string_view text, absl::string_view also) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [also](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' ||
           also.find(c) != absl::string_view::npos;
  });
}

}  // namespace

std::optional<GrpcWebFormat> GrpcWebFormatOf(absl::string_view content_type) {
  const std::string type = absl::AsciiStrToLower(
      absl::StripAsciiWhitespace(content_type.substr(0, content_type.find(';'))));
  if (type == "application/grpc-web" || type == "application/grpc-web+proto") {
    return GrpcWebFormat::kBinary;
  }
  if (type == "application/grpc-web-text" || type == "application/grpc-web-text+proto") {
    return GrpcWebFormat::kText;
  }
  return std::nullopt;
}

absl::string_view ContentTypeOf(GrpcWebFormat format) {
  return format == GrpcWebFormat::kText ? "application/grpc-web-text+proto"
                                        : "application/grpc-web+proto";
}

absl::StatusOr<std::string> DecodeGrpcWebRequest(absl::string_view body, GrpcWebFormat format) {
  std::string decoded;
  if (format == GrpcWebFormat::kText) {
    absl::StatusOr<std::string> bytes = DecodeText(body);
    if (!bytes.ok()) return bytes.status();
    decoded = *std::move(bytes);
    body = decoded;
  }
  if (body.size() < kFrameHead) {
    return absl::InvalidArgumentError(
        absl::StrCat("request body: ", body.size(), " bytes, a gRPC-Web frame has at least 5"));
  }
  const auto byte = [&body](std::size_t i) { return static_cast<unsigned char>(body[i]); };
  if (byte(0) & kCompressed) {
    return absl::UnimplementedError("request body: compressed frames are not taken; send identity");
  }
  if (byte(0) != 0) return absl::InvalidArgumentError("request body: not a data frame");
  const std::uint64_t size = std::uint64_t{byte(1)} << 24 | std::uint64_t{byte(2)} << 16 |
                             std::uint64_t{byte(3)} << 8 | byte(4);
  if (size != body.size() - kFrameHead) {
    return absl::InvalidArgumentError(absl::StrCat("request body: the frame says ", size,
                                                   " bytes, ", body.size() - kFrameHead,
                                                   " follow; send exactly one message"));
  }
  return std::string(body.substr(kFrameHead));
}

std::string EncodeGrpcWebMessage(absl::string_view message, GrpcWebFormat format) {
  return Frame(0, message, format);
}

std::string EncodeGrpcWebTrailers(const CallResult& result, GrpcWebFormat format) {
  std::string block = absl::StrCat("grpc-status: ", result.code, "\r\n");
  if (!result.message.empty()) {
    absl::StrAppend(&block, "grpc-message: ", PercentEncode(result.message), "\r\n");
  }
  if (!result.details.empty()) {
    absl::StrAppend(&block, "grpc-status-details-bin: ", absl::Base64Escape(result.details),
                    "\r\n");
  }
  for (const auto& [name, value] : result.trailers) {
    const bool binary = absl::EndsWith(name, "-bin");
    absl::StrAppend(&block, name, ": ", binary ? absl::Base64Escape(value) : value, "\r\n");
  }
  return Frame(kTrailers, block, format);
}

std::optional<std::chrono::nanoseconds> ParseGrpcTimeout(absl::string_view text) {
  if (text.size() < 2 || text.size() > 9) return std::nullopt;
  const absl::string_view digits = text.substr(0, text.size() - 1);
  std::int64_t count = 0;
  if (!std::all_of(digits.begin(), digits.end(), absl::ascii_isdigit) ||
      !absl::SimpleAtoi(digits, &count)) {
    return std::nullopt;
  }
  const auto unit_ns = [&]() -> std::int64_t {
    switch (text.back()) {
      case 'H':
        return 3'600'000'000'000;
      case 'M':
        return 60'000'000'000;
      case 'S':
        return 1'000'000'000;
      case 'm':
        return 1'000'000;
      case 'u':
        return 1'000;
      case 'n':
        return 1;
      default:
        return 0;
    }
  }();
  if (unit_ns == 0) return std::nullopt;
  // Longer than a week is as good as none, and would overflow the clock.
  constexpr std::int64_t kWeekNs = 7 * 24 * 3'600'000'000'000;
  if (count > kWeekNs / unit_ns) return std::chrono::nanoseconds(kWeekNs);
  return std::chrono::nanoseconds(count * unit_ns);
}

bool IsMetadataValue(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
}

bool IsMethodPath(absl::string_view path) {
  if (path.empty() || path.front() != '/') return false;
  const std::vector<absl::string_view> parts = absl::StrSplit(path.substr(1), '/');
  return parts.size() == 2 && IsIdentifier(parts[0], ".") && IsIdentifier(parts[1], "");
}

}  // namespace saccade
