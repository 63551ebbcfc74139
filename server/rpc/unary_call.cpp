#include "server/rpc/unary_call.hpp"

#include "server/pipeline/busy.hpp"
#include "server/rpc/status.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxOutcomeBytes = 300;

}  // namespace

absl::StatusOr<Access> UnaryCall::Enter(Gatekeeper& gate, std::optional<Toll> toll) {
  book_ = &gate.book();
  absl::StatusOr<Access> access = gate.Enter(*context_, method_, toll);
  NoteAccess(gate);
  return access;
}

absl::StatusOr<Session> UnaryCall::Member(Gatekeeper& gate, std::optional<Toll> toll,
                                          const std::string& session_id) {
  book_ = &gate.book();
  absl::StatusOr<Session> session = gate.Member(*context_, method_, toll, session_id);
  NoteAccess(gate);
  if (session.ok()) Is(*session);
  return session;
}

// Also of who is refused for another reason: it is they who tried.
void UnaryCall::NoteAccess(const Gatekeeper& gate) {
  const absl::StatusOr<Access> access = gate.Who(*context_);
  if (access.ok()) access_id_ = access->id;
}

void UnaryCall::Is(const Session& session) {
  participant_id_ = session.participant_id;
  display_name_ = session.display_name;
  access_id_ = session.access_id;
}

UnaryCall::Reactor* UnaryCall::Finish(const absl::Status& status) const {
  if (log_ == Log::kAll || (log_ == Log::kRefusals && !status.ok())) {
    Audit(method_, participant_id_, status);
    Keep(status);
  }
  reactor_->Finish(ToGrpc(status));
  return reactor_;
}

// Of a flood nothing, as it changed nothing; and of strangers who were refused nothing, who would
// fill the disk with it (the log has them).
void UnaryCall::Keep(const absl::Status& status) const {
  if (book_ == nullptr || RetryInfoOf(status)) return;
  if (!status.ok() && access_id_.empty()) return;
  const std::string outcome =
      status.ok() ? outcome_ : status.ToString().substr(0, kMaxOutcomeBytes);
  book_->Record({0, participant_id_, display_name_, access_id_, "", method_, outcome});
}

UnaryCall::Reactor* UnaryCall::Submitted(const absl::Status& queued) const {
  return queued.ok() ? reactor_ : Finish(queued);
}

}  // namespace saccade
