#pragma once

#include <memory>

#include "saccade/v1/session.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// The service with a stream of encoded events: what many subscribers are sent is encoded once.
using SessionServiceBase =
    v1::SessionService::WithCallbackMethod_Join<v1::SessionService::WithRawCallbackMethod_Subscribe<
        v1::SessionService::WithCallbackMethod_Acknowledge<
            v1::SessionService::WithCallbackMethod_Ping<
                v1::SessionService::WithCallbackMethod_GetFrame<
                    v1::SessionService::WithCallbackMethod_GetStatus<
                        v1::SessionService::WithCallbackMethod_PausePicture<
                            v1::SessionService::Service>>>>>>>;

/// Joining, the stream, stills, clock, the large pause. Handlers run on gRPC's threads and never
/// block.
class SessionService final : public SessionServiceBase {
 public:
  SessionService(Backend& backend, StreamHub& hub, Gatekeeper& gate);

 private:
  grpc::ServerUnaryReactor* Join(grpc::CallbackServerContext* context,
                                 const v1::JoinRequest* request,
                                 v1::JoinResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Subscribe(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* Acknowledge(grpc::CallbackServerContext* context,
                                        const v1::AcknowledgeRequest* request,
                                        v1::AcknowledgeResponse* response) override;
  grpc::ServerUnaryReactor* Ping(grpc::CallbackServerContext* context,
                                 const v1::PingRequest* request,
                                 v1::PingResponse* response) override;
  grpc::ServerUnaryReactor* GetFrame(grpc::CallbackServerContext* context,
                                     const v1::GetFrameRequest* request,
                                     v1::GetFrameResponse* response) override;
  grpc::ServerUnaryReactor* GetStatus(grpc::CallbackServerContext* context,
                                      const v1::GetStatusRequest* request,
                                      v1::GetStatusResponse* response) override;
  grpc::ServerUnaryReactor* PausePicture(grpc::CallbackServerContext* context,
                                         const v1::PausePictureRequest* request,
                                         v1::PausePictureResponse* response) override;

  Backend& backend_;
  StreamHub& hub_;
  Gatekeeper& gate_;
  const Timestamp started_ns_;
};

}  // namespace saccade
