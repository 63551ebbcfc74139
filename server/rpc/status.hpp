#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <string>

namespace saccade {

/// The same code and message. An InvalidArgument, whose message starts with "field.path: ", also
/// carries google.rpc.BadRequest naming that field (grpc-status-details-bin).
grpc::Status ToGrpc(const absl::Status& status);

/// One line on stderr: time, method, session, outcome. Never what was written in an annotation.
void Audit(const char* method, const std::string& session_id, const absl::Status& status);

}  // namespace saccade
