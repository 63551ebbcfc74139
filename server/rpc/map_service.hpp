#pragma once

#include "saccade/v1/map.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/stream_hub.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

/// The map at large, and those that are kept. What is more than looking is for those who steer.
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
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteMapRequest* request,
                                   v1::DeleteMapResponse* response) override;
  grpc::ServerUnaryReactor* ExportFile(grpc::CallbackServerContext* context,
                                       const v1::ExportMapFileRequest* request,
                                       v1::ExportMapFileResponse* response) override;
  grpc::ServerUnaryReactor* ImportFile(grpc::CallbackServerContext* context,
                                       const v1::ImportMapFileRequest* request,
                                       v1::ImportMapFileResponse* response) override;
  /// Whether the call may come in, and where maps are kept.
  absl::StatusOr<KeptMaps*> Enter(UnaryCall& call, Toll toll);

  Backend& backend_;
  StreamHub& hub_;
  Gatekeeper& gate_;
};

}  // namespace saccade
