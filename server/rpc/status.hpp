#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <string>

namespace saccade {

/// The same code and message. An InvalidArgument, whose message starts with "field.path: ", also
/// carries google.rpc.BadRequest naming that field (grpc-status-details-bin); what comes too often
/// (`BusyError`) carries google.rpc.RetryInfo.
grpc::Status ToGrpc(const absl::Status& status);

/// One line on stderr: time, method ("SessionService/Join" as "Join"), participant, outcome. Never
/// what was written in an annotation, nor the credential. Of what came too often one line a second,
/// with their number.
void Audit(const char* method, const std::string& participant_id, const absl::Status& status);

}  // namespace saccade
