#include "server/rpc/gaze_service.hpp"

#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/gaze.hpp"

namespace saccade {
namespace {

GazeCaller CallerOf(const Session& session) {
  return {{session.participant_id, session.display_name}, session.role == v1::ROLE_WEARER};
}

/// The state just after the command.
template <typename Response>
Done<std::shared_ptr<const GazeSnapshot>> AnswerWithState(const UnaryCall& call,
                                                          Response* response) {
  return call.Answer<std::shared_ptr<const GazeSnapshot>>(
      [response](const std::shared_ptr<const GazeSnapshot>& state) {
        *response->mutable_state() = wire::ToProto(*state);
      });
}

}  // namespace

GazeService::GazeService(Backend& backend, Gatekeeper& gate) : backend_(backend), gate_(gate) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "GazeService/GetState", this, &GazeService::GetState));
  MarkMethodCallback(1, Early(gate, "GazeService/AcquireLease", this, &GazeService::AcquireLease));
  MarkMethodCallback(2, Early(gate, "GazeService/ReleaseLease", this, &GazeService::ReleaseLease));
  MarkMethodCallback(3, Early(gate, "GazeService/Fixate", this, &GazeService::Fixate));
  MarkMethodCallback(4, Early(gate, "GazeService/StopFixating", this, &GazeService::StopFixating));
  MarkMethodCallback(5, Early(gate, "GazeService/Home", this, &GazeService::Home));
  MarkMethodCallback(6, Early(gate, "GazeService/KeepHorizon", this, &GazeService::KeepHorizon));
  MarkMethodCallback(7, Early(gate, "GazeService/Explore", this, &GazeService::Explore));
  MarkMethodCallback(8,
                     Early(gate, "GazeService/CalibrateMount", this, &GazeService::CalibrateMount));
  MarkMethodCallback(
      9, Early(gate, "GazeService/GetMountCalibration", this, &GazeService::GetMountCalibration));
  MarkMethodCallback(10, Early(gate, "GazeService/Override", this, &GazeService::Override));
  MarkMethodCallback(11, Early(gate, "GazeService/Pause", this, &GazeService::Pause));
}

template <typename Request, typename Make>
grpc::ServerUnaryReactor* GazeService::Order(Context* context, const Request* request,
                                             const char* method, Make make) {
  UnaryCall call(*context, method, UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kGaze, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::StatusOr<GazeCommand> command = make(call, CallerOf(*session));
  if (!command.ok()) return call.Finish(command.status());
  return call.Submitted(backend_.SubmitGaze(*std::move(command)));
}

grpc::ServerUnaryReactor* GazeService::GetState(Context* context,
                                                const v1::GetGazeStateRequest* /*request*/,
                                                v1::GetGazeStateResponse* response) {
  UnaryCall call(*context, "GazeService/GetState", UnaryCall::Log::kNothing);
  const absl::Status entered = call.Enter(gate_, Toll::kRead).status();
  if (entered.ok()) *response->mutable_state() = wire::ToProto(*backend_.gaze());
  return call.Finish(entered);
}

grpc::ServerUnaryReactor* GazeService::AcquireLease(Context* context,
                                                    const v1::AcquireLeaseRequest* request,
                                                    v1::AcquireLeaseResponse* response) {
  return Order(
      context, request, "GazeService/AcquireLease",
      [request, response](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
        if (!request->lease_id().empty()) {
          absl::Status uuid = wire::CheckUuid(request->lease_id(), "lease_id");
          if (!uuid.ok()) return uuid;
          // Heartbeats, several a second, are not worth a line each.
          call.set_log(UnaryCall::Log::kRefusals);
        }
        const auto fill = [response](const LeaseAnswer& answer) {
          response->set_granted(answer.granted);
          response->set_lease_id(answer.lease_id);
          response->set_queue_position(static_cast<std::uint32_t>(answer.queue_position));
          *response->mutable_pilot() = wire::ToProto(answer.pilot);
        };
        return AcquireGazeLease{std::move(caller), request->lease_id(),
                                call.Answer<LeaseAnswer>(fill)};
      });
}

grpc::ServerUnaryReactor* GazeService::ReleaseLease(Context* context,
                                                    const v1::ReleaseLeaseRequest* request,
                                                    v1::ReleaseLeaseResponse* /*response*/) {
  return Order(context, request, "GazeService/ReleaseLease",
               [](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
                 return ReleaseGazeLease{std::move(caller), call.Answer()};
               });
}

grpc::ServerUnaryReactor* GazeService::Fixate(Context* context, const v1::FixateRequest* request,
                                              v1::FixateResponse* response) {
  return Order(
      context, request, "GazeService/Fixate",
      [request, response](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
        absl::StatusOr<GazeTarget> target = wire::FromProto(request->target(), "target");
        if (!target.ok()) return target.status();
        return FixateGaze{std::move(caller), *std::move(target), request->fast(),
                          AnswerWithState(call, response)};
      });
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* GazeService::Steer(Context* context, const Request* request,
                                             Response* response, const char* method,
                                             SteerGaze::What what) {
  return Order(context, request, method,
               [response, what](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
                 return SteerGaze{std::move(caller), what, AnswerWithState(call, response)};
               });
}

grpc::ServerUnaryReactor* GazeService::StopFixating(Context* context,
                                                    const v1::StopFixatingRequest* request,
                                                    v1::StopFixatingResponse* response) {
  return Steer(context, request, response, "GazeService/StopFixating", SteerGaze::What::kStop);
}

grpc::ServerUnaryReactor* GazeService::Home(Context* context, const v1::HomeRequest* request,
                                            v1::HomeResponse* response) {
  return Steer(context, request, response, "GazeService/Home", SteerGaze::What::kHome);
}

grpc::ServerUnaryReactor* GazeService::KeepHorizon(Context* context,
                                                   const v1::KeepHorizonRequest* request,
                                                   v1::KeepHorizonResponse* response) {
  return Steer(context, request, response, "GazeService/KeepHorizon", SteerGaze::What::kHorizon);
}

grpc::ServerUnaryReactor* GazeService::Explore(Context* context, const v1::ExploreRequest* request,
                                               v1::ExploreResponse* response) {
  return Steer(context, request, response, "GazeService/Explore", SteerGaze::What::kExplore);
}

grpc::ServerUnaryReactor* GazeService::CalibrateMount(Context* context,
                                                      const v1::CalibrateMountRequest* request,
                                                      v1::CalibrateMountResponse* response) {
  return Steer(context, request, response, "GazeService/CalibrateMount",
               SteerGaze::What::kCalibrate);
}

grpc::ServerUnaryReactor* GazeService::GetMountCalibration(
    Context* context, const v1::GetMountCalibrationRequest* /*request*/,
    v1::GetMountCalibrationResponse* response) {
  UnaryCall call(*context, "GazeService/GetMountCalibration", UnaryCall::Log::kNothing);
  if (const auto access = call.Enter(gate_, Toll::kRead); !access.ok()) {
    return call.Finish(access.status());
  }
  const std::shared_ptr<const MountCalibrationReport> report = backend_.gaze()->calibration;
  if (report == nullptr) {
    return call.Finish(absl::NotFoundError(
        "calibrate-mount: nobody has calibrated since the server started; call CalibrateMount"));
  }
  *response->mutable_calibration() = wire::ToProto(*report);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* GazeService::Override(Context* context,
                                                const v1::OverrideRequest* request,
                                                v1::OverrideResponse* /*response*/) {
  return Order(context, request, "GazeService/Override",
               [request](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
                 return OverrideGaze{std::move(caller), request->enabled(), call.Answer()};
               });
}

grpc::ServerUnaryReactor* GazeService::Pause(Context* context, const v1::PauseRequest* request,
                                             v1::PauseResponse* /*response*/) {
  return Order(context, request, "GazeService/Pause",
               [request](UnaryCall& call, GazeCaller caller) -> absl::StatusOr<GazeCommand> {
                 return PauseGaze{std::move(caller), request->paused(), call.Answer()};
               });
}

}  // namespace saccade
