#pragma once

#include "saccade/v1/gaze.grpc.pb.h"

namespace saccade {

/// State only: this build steers no mount.
class GazeService final : public v1::GazeService::CallbackService {
 private:
  grpc::ServerUnaryReactor* GetState(grpc::CallbackServerContext* context,
                                     const v1::GetGazeStateRequest* request,
                                     v1::GetGazeStateResponse* response) override;
};

}  // namespace saccade
