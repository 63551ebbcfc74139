#pragma once

#include "saccade/v1/map.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// The map at large. Reset is for those who may edit. Save, Load and List answer UNIMPLEMENTED.
/// Handlers never block.
class MapService final : public v1::MapService::CallbackService {
 public:
  MapService(Backend& backend, StreamHub& hub, Gatekeeper& gate);

 private:
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetMapRequest* request,
                                v1::GetMapResponse* response) override;
  grpc::ServerUnaryReactor* Reset(grpc::CallbackServerContext* context,
                                  const v1::ResetMapRequest* request,
                                  v1::ResetMapResponse* response) override;
  grpc::ServerUnaryReactor* Export(grpc::CallbackServerContext* context,
                                   const v1::ExportMapRequest* request,
                                   v1::ExportMapResponse* response) override;
  grpc::ServerUnaryReactor* Save(grpc::CallbackServerContext* context,
                                 const v1::SaveMapRequest* request,
                                 v1::SaveMapResponse* response) override;
  grpc::ServerUnaryReactor* Load(grpc::CallbackServerContext* context,
                                 const v1::LoadMapRequest* request,
                                 v1::LoadMapResponse* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListMapsRequest* request,
                                 v1::ListMapsResponse* response) override;
  /// UNIMPLEMENTED, to whom the method would be open.
  grpc::ServerUnaryReactor* NotYet(grpc::CallbackServerContext* context, const char* method);

  Backend& backend_;
  StreamHub& hub_;
  Gatekeeper& gate_;
};

}  // namespace saccade
