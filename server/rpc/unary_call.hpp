#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/support/server_callback.h>

#include <optional>
#include <string>
#include <utility>

#include "server/pipeline/commands.hpp"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// One unary call on its way to its one answer: who asked for what, the reactor that answers, and
/// what is logged of it. A handler makes one, asks for admission, checks, and either finishes it or
/// leaves it to a command's `done`. Copies are the same call; a call is finished once, from any
/// thread.
class UnaryCall {
 public:
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  /// Which ends are worth a line in the log.
  enum class Log { kAll, kRefusals, kNothing };

  /// `method` as the table of roles has it, "SessionService/Join"; must outlive the call: a
  /// literal.
  UnaryCall(Context& context, const char* method, Log log)
      : context_(&context), reactor_(context.DefaultReactor()), method_(method), log_(log) {}

  void set_log(Log log) { log_ = log; }
  /// What the audit says of it if it ends well.
  void set_outcome(const std::string& outcome) { outcome_ = outcome; }

  // Admission (Gatekeeper); the log names whom it knows from then on.
  absl::StatusOr<Access> Enter(Gatekeeper& gate, std::optional<Toll> toll);
  absl::StatusOr<Session> Member(Gatekeeper& gate, std::optional<Toll> toll,
                                 const std::string& session_id);
  void Is(const Session& session);

  /// For gRPC, where a `done` answers.
  Reactor* reactor() const { return reactor_; }
  /// Logs and answers.
  Reactor* Finish(const absl::Status& status) const;
  /// After a command was handed over: its `done` answers, unless it was not taken.
  Reactor* Submitted(const absl::Status& queued) const;

  /// The `done` of a command without a result.
  DoneEmpty Answer() const {
    return [call = *this](const absl::Status& status) { call.Finish(status); };
  }
  /// The `done` of a command with one: `fill` puts it into the response, if there is one.
  template <typename Result, typename Fill>
  Done<Result> Answer(Fill fill) const {
    return [call = *this, fill = std::move(fill)](const absl::StatusOr<Result>& result) {
      if (result.ok()) fill(*result);
      call.Finish(result.status());
    };
  }

 private:
  void NoteAccess(const Gatekeeper& gate);
  void Keep(const absl::Status& status) const;

  Context* context_;  // gone once the call is finished
  Reactor* reactor_;
  const char* method_;
  Log log_;
  std::string outcome_ = "ok";
  AccessBook* book_ = nullptr;                             // from admission on
  std::string participant_id_, display_name_, access_id_;  // empty: not known
};

}  // namespace saccade
