#pragma once

#include "saccade/v1/scene.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/model_uploads.hpp"

namespace saccade {

/// Known geometry and virtual things. Handlers run on gRPC's threads and never block.
class SceneService final : public v1::SceneService::CallbackService {
 public:
  static constexpr std::size_t kMostSent = 512 * 1024;  // bytes of a model in one answer
  static constexpr int kMostCorrespondences = 200;

  SceneService(Backend& backend, Gatekeeper& gate);

 private:
  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* ListScene(Context* context, const v1::ListSceneRequest* request,
                                      v1::ListSceneResponse* response) override;
  grpc::ServerUnaryReactor* PutObject(Context* context, const v1::PutSceneObjectRequest* request,
                                      v1::PutSceneObjectResponse* response) override;
  grpc::ServerUnaryReactor* RemoveObject(Context* context,
                                         const v1::RemoveSceneObjectRequest* request,
                                         v1::RemoveSceneObjectResponse* response) override;
  grpc::ServerUnaryReactor* PlaceObject(Context* context,
                                        const v1::PlaceSceneObjectRequest* request,
                                        v1::PlaceSceneObjectResponse* response) override;
  grpc::ServerUnaryReactor* UploadModel(Context* context, const v1::UploadModelRequest* request,
                                        v1::UploadModelResponse* response) override;
  grpc::ServerUnaryReactor* GetModel(Context* context, const v1::GetModelRequest* request,
                                     v1::GetModelResponse* response) override;
  grpc::ServerUnaryReactor* RegisterObject(Context* context,
                                           const v1::RegisterSceneObjectRequest* request,
                                           v1::RegisterSceneObjectResponse* response) override;

  Backend& backend_;
  Gatekeeper& gate_;
  ModelUploads uploads_;
};

}  // namespace saccade
