#pragma once

#include "saccade/v1/recording.grpc.pb.h"
#include "server/pipeline/recording.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

/// Starts and ends recordings, for whose eyes they are of; says how they go. Handlers never block.
class RecordingService final : public v1::RecordingService::CallbackService {
 public:
  /// `port` null: nothing is recorded here.
  RecordingService(RecordingPort* port, Gatekeeper& gate);

 private:
  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* GetRecording(Context* context, const v1::GetRecordingRequest* request,
                                         v1::GetRecordingResponse* response) override;
  grpc::ServerUnaryReactor* StartRecording(Context* context,
                                           const v1::StartRecordingRequest* request,
                                           v1::StartRecordingResponse* response) override;
  grpc::ServerUnaryReactor* StopRecording(Context* context, const v1::StopRecordingRequest* request,
                                          v1::StopRecordingResponse* response) override;
  absl::Status Enter(UnaryCall& call, Toll toll);

  RecordingPort* const port_;
  Gatekeeper& gate_;
};

}  // namespace saccade
