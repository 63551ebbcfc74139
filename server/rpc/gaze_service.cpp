#include "server/rpc/gaze_service.hpp"

#include "server/rpc/status.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/gaze.hpp"

namespace saccade {
namespace {

grpc::ServerUnaryReactor* Refuse(grpc::ServerUnaryReactor* reactor, const char* method,
                                 const std::string& session_id, const absl::Status& status) {
  Audit(method, session_id, status);
  reactor->Finish(ToGrpc(status));
  return reactor;
}

/// Finishes with the state just after the command.
template <typename Response>
Done<std::shared_ptr<const GazeSnapshot>> AnswerWithState(grpc::ServerUnaryReactor* reactor,
                                                          Response* response, const char* method,
                                                          const std::string& session_id) {
  return [reactor, response, method,
          session_id](const absl::StatusOr<std::shared_ptr<const GazeSnapshot>>& state) {
    if (state.ok()) *response->mutable_state() = wire::ToProto(**state);
    Audit(method, session_id, state.status());
    reactor->Finish(ToGrpc(state.status()));
  };
}

DoneEmpty Answer(grpc::ServerUnaryReactor* reactor, const char* method,
                 const std::string& session_id) {
  return [reactor, method, session_id](const absl::Status& status) {
    Audit(method, session_id, status);
    reactor->Finish(ToGrpc(status));
  };
}

}  // namespace

absl::StatusOr<GazeCaller> GazeService::CallerOf(const Context& context,
                                                 const std::string& session_id) {
  const absl::StatusOr<Session> session = gate_.Editor(context, Toll::kGaze, session_id);
  if (!session.ok()) return session.status();
  return GazeCaller{{session->participant_id, session->display_name},
                    session->role == v1::ROLE_WEARER};
}

void GazeService::Submit(Reactor* reactor, const char* method, const std::string& session_id,
                         GazeCommand command) {
  const absl::Status queued = backend_.SubmitGaze(std::move(command));
  if (!queued.ok()) Refuse(reactor, method, session_id, queued);
}

grpc::ServerUnaryReactor* GazeService::GetState(Context* context,
                                                const v1::GetGazeStateRequest* /*request*/,
                                                v1::GetGazeStateResponse* response) {
  Reactor* reactor = context->DefaultReactor();
  const absl::Status often = gate_.Anyone(*context, Toll::kRead);
  if (often.ok()) *response->mutable_state() = wire::ToProto(*backend_.gaze());
  reactor->Finish(ToGrpc(often));
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::AcquireLease(Context* context,
                                                    const v1::AcquireLeaseRequest* request,
                                                    v1::AcquireLeaseResponse* response) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, "AcquireLease", "", caller.status());
  const std::string session_id = caller->pilot.participant_id;
  const bool renews = !request->lease_id().empty();
  if (renews) {
    absl::Status uuid = wire::CheckUuid(request->lease_id(), "lease_id");
    if (!uuid.ok()) return Refuse(reactor, "AcquireLease", session_id, uuid);
  }
  Submit(reactor, "AcquireLease", session_id,
         AcquireGazeLease{
             *std::move(caller), request->lease_id(),
             [reactor, response, session_id, renews](const absl::StatusOr<LeaseAnswer>& answer) {
               if (answer.ok()) {
                 response->set_granted(answer->granted);
                 response->set_lease_id(answer->lease_id);
                 response->set_queue_position(static_cast<std::uint32_t>(answer->queue_position));
                 *response->mutable_pilot() = wire::ToProto(answer->pilot);
               }
               // Heartbeats, several a second, are not worth a line each.
               if (!renews || !answer.ok()) Audit("AcquireLease", session_id, answer.status());
               reactor->Finish(ToGrpc(answer.status()));
             }});
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::ReleaseLease(Context* context,
                                                    const v1::ReleaseLeaseRequest* request,
                                                    v1::ReleaseLeaseResponse* /*response*/) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, "ReleaseLease", "", caller.status());
  const std::string id = caller->pilot.participant_id;
  Submit(reactor, "ReleaseLease", id,
         ReleaseGazeLease{*std::move(caller), Answer(reactor, "ReleaseLease", id)});
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::Fixate(Context* context, const v1::FixateRequest* request,
                                              v1::FixateResponse* response) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, "Fixate", "", caller.status());
  const std::string id = caller->pilot.participant_id;
  absl::StatusOr<GazeTarget> target = wire::FromProto(request->target(), "target");
  if (!target.ok()) return Refuse(reactor, "Fixate", id, target.status());
  Submit(reactor, "Fixate", id,
         FixateGaze{*std::move(caller), *std::move(target), request->fast(),
                    AnswerWithState(reactor, response, "Fixate", id)});
  return reactor;
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* GazeService::Steer(Context* context, const Request* request,
                                             Response* response, const char* method,
                                             SteerGaze::What what) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, method, "", caller.status());
  const std::string id = caller->pilot.participant_id;
  Submit(reactor, method, id,
         SteerGaze{*std::move(caller), what, AnswerWithState(reactor, response, method, id)});
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::StopFixating(Context* context,
                                                    const v1::StopFixatingRequest* request,
                                                    v1::StopFixatingResponse* response) {
  return Steer(context, request, response, "StopFixating", SteerGaze::What::kStop);
}

grpc::ServerUnaryReactor* GazeService::Home(Context* context, const v1::HomeRequest* request,
                                            v1::HomeResponse* response) {
  return Steer(context, request, response, "Home", SteerGaze::What::kHome);
}

grpc::ServerUnaryReactor* GazeService::KeepHorizon(Context* context,
                                                   const v1::KeepHorizonRequest* request,
                                                   v1::KeepHorizonResponse* response) {
  return Steer(context, request, response, "KeepHorizon", SteerGaze::What::kHorizon);
}

grpc::ServerUnaryReactor* GazeService::Explore(Context* context, const v1::ExploreRequest* request,
                                               v1::ExploreResponse* response) {
  return Steer(context, request, response, "Explore", SteerGaze::What::kExplore);
}

grpc::ServerUnaryReactor* GazeService::CalibrateMount(Context* context,
                                                      const v1::CalibrateMountRequest* request,
                                                      v1::CalibrateMountResponse* response) {
  return Steer(context, request, response, "CalibrateMount", SteerGaze::What::kCalibrate);
}

grpc::ServerUnaryReactor* GazeService::GetMountCalibration(
    Context* context, const v1::GetMountCalibrationRequest* /*request*/,
    v1::GetMountCalibrationResponse* response) {
  Reactor* reactor = context->DefaultReactor();
  const std::shared_ptr<const MountCalibrationReport> report = backend_.gaze()->calibration;
  if (report == nullptr) {
    reactor->Finish(ToGrpc(absl::NotFoundError(
        "calibrate-mount: nobody has calibrated since the server started; call CalibrateMount")));
    return reactor;
  }
  *response->mutable_calibration() = wire::ToProto(*report);
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::Override(Context* context,
                                                const v1::OverrideRequest* request,
                                                v1::OverrideResponse* /*response*/) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, "Override", "", caller.status());
  const std::string id = caller->pilot.participant_id;
  Submit(reactor, "Override", id,
         OverrideGaze{*std::move(caller), request->enabled(), Answer(reactor, "Override", id)});
  return reactor;
}

grpc::ServerUnaryReactor* GazeService::Pause(Context* context, const v1::PauseRequest* request,
                                             v1::PauseResponse* /*response*/) {
  Reactor* reactor = context->DefaultReactor();
  absl::StatusOr<GazeCaller> caller = CallerOf(*context, request->session_id());
  if (!caller.ok()) return Refuse(reactor, "Pause", "", caller.status());
  const std::string id = caller->pilot.participant_id;
  Submit(reactor, "Pause", id,
         PauseGaze{*std::move(caller), request->paused(), Answer(reactor, "Pause", id)});
  return reactor;
}

}  // namespace saccade
