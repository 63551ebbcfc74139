#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace saccade {

/// The two bodies of gRPC-Web (PROTOCOL-WEB.md of gRPC): bytes, or the same in base64.
enum class GrpcWebFormat { kBinary, kText };

using Metadata = std::vector<std::pair<std::string, std::string>>;

/// How a call ended. `code` as in gRPC, 0 to 16; `details` is `grpc-status-details-bin`, not
/// encoded.
struct CallResult {
  int code = 0;
  std::string message;
  std::string details;
  Metadata trailers;
};

/// Format of a Content-Type; nothing if it is not gRPC-Web with protobuf.
std::optional<GrpcWebFormat> GrpcWebFormatOf(absl::string_view content_type);

/// The Content-Type of an answer.
absl::string_view ContentTypeOf(GrpcWebFormat format);

/// The one message of a request's body.
///   InvalidArgument  not exactly one complete frame, or broken base64
///   Unimplemented    the frame is compressed
absl::StatusOr<std::string> DecodeGrpcWebRequest(absl::string_view body, GrpcWebFormat format);

/// A data frame: 5 bytes of head, then `message`.
std::string EncodeGrpcWebMessage(absl::string_view message, GrpcWebFormat format);

/// The frame that ends a stream, with grpc-status, grpc-message and the trailing metadata.
std::string EncodeGrpcWebTrailers(const CallResult& result, GrpcWebFormat format);

/// `grpc-timeout`, e.g. "1500m" (milliseconds): up to 8 digits and one of H M S m u n.
std::optional<std::chrono::nanoseconds> ParseGrpcTimeout(absl::string_view text);

/// True if gRPC takes `text` as the value of ASCII metadata: printable ASCII. Anything else aborts
/// the process that adds it.
bool IsMetadataValue(absl::string_view text);

/// True for `/package.Service/Method` of identifiers only.
bool IsMethodPath(absl::string_view path);

}  // namespace saccade
