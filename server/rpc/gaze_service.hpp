#pragma once

#include "saccade/v1/gaze.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// Who steers, and where to: check, submit to the gaze thread, answer. Handlers run on gRPC's
/// threads and never block.
class GazeService final : public v1::GazeService::CallbackService {
 public:
  GazeService(Backend& backend, Gatekeeper& gate);

 private:
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  Reactor* GetState(Context* context, const v1::GetGazeStateRequest* request,
                    v1::GetGazeStateResponse* response) override;
  Reactor* AcquireLease(Context* context, const v1::AcquireLeaseRequest* request,
                        v1::AcquireLeaseResponse* response) override;
  Reactor* ReleaseLease(Context* context, const v1::ReleaseLeaseRequest* request,
                        v1::ReleaseLeaseResponse* response) override;
  Reactor* Fixate(Context* context, const v1::FixateRequest* request,
                  v1::FixateResponse* response) override;
  Reactor* StopFixating(Context* context, const v1::StopFixatingRequest* request,
                        v1::StopFixatingResponse* response) override;
  Reactor* Home(Context* context, const v1::HomeRequest* request,
                v1::HomeResponse* response) override;
  Reactor* KeepHorizon(Context* context, const v1::KeepHorizonRequest* request,
                       v1::KeepHorizonResponse* response) override;
  Reactor* Explore(Context* context, const v1::ExploreRequest* request,
                   v1::ExploreResponse* response) override;
  Reactor* CalibrateMount(Context* context, const v1::CalibrateMountRequest* request,
                          v1::CalibrateMountResponse* response) override;
  Reactor* GetMountCalibration(Context* context, const v1::GetMountCalibrationRequest* request,
                               v1::GetMountCalibrationResponse* response) override;
  Reactor* Override(Context* context, const v1::OverrideRequest* request,
                    v1::OverrideResponse* response) override;
  Reactor* Pause(Context* context, const v1::PauseRequest* request,
                 v1::PauseResponse* response) override;

  /// A call of an editor that is one command for the gaze thread: `make(call, caller)` checks the
  /// request and makes it.
  template <typename Request, typename Make>
  Reactor* Order(Context* context, const Request* request, const char* method, Make make);
  template <typename Request, typename Response>
  Reactor* Steer(Context* context, const Request* request, Response* response, const char* method,
                 SteerGaze::What what);

  Backend& backend_;
  Gatekeeper& gate_;
};

}  // namespace saccade
