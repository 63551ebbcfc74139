#include "server/rpc/unary_call.hpp"

#include "server/rpc/status.hpp"

namespace saccade {

absl::StatusOr<Session> UnaryCall::Member(Gatekeeper& gate, std::optional<Toll> toll,
                                          const std::string& session_id) {
  absl::StatusOr<Session> session = gate.Member(*context_, method_, toll, session_id);
  if (session.ok()) Is(*session);
  return session;
}

UnaryCall::Reactor* UnaryCall::Finish(const absl::Status& status) const {
  if (log_ == Log::kAll || (log_ == Log::kRefusals && !status.ok())) {
    Audit(method_, participant_id_, status);
  }
  reactor_->Finish(ToGrpc(status));
  return reactor_;
}

UnaryCall::Reactor* UnaryCall::Submitted(const absl::Status& queued) const {
  return queued.ok() ? reactor_ : Finish(queued);
}

}  // namespace saccade
