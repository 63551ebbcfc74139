#include "server/rpc/gaze_service.hpp"

namespace saccade {

grpc::ServerUnaryReactor* GazeService::GetState(grpc::CallbackServerContext* context,
                                                const v1::GetGazeStateRequest* /*request*/,
                                                v1::GetGazeStateResponse* response) {
  response->mutable_state()->set_mode(v1::GAZE_MODE_NO_MOUNT);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace saccade
