#pragma once

#include "saccade/v1/replay.grpc.pb.h"
#include "server/pipeline/replay.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

/// Where a replay is, and where it is to go. Handlers never block.
class ReplayService final : public v1::ReplayService::CallbackService {
 public:
  /// `port` null: none is played here.
  ReplayService(ReplayPort* port, Gatekeeper& gate);

 private:
  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* GetReplay(Context* context, const v1::GetReplayRequest* request,
                                      v1::GetReplayResponse* response) override;
  grpc::ServerUnaryReactor* ChangeReplay(Context* context, const v1::ChangeReplayRequest* request,
                                         v1::ChangeReplayResponse* response) override;
  absl::Status Enter(UnaryCall& call, Toll toll);

  ReplayPort* const port_;
  Gatekeeper& gate_;
};

}  // namespace saccade
