#include <absl/strings/str_cat.h>

#include "client/net/connection_impl.hpp"
#include "client/net/model_upload.hpp"
#include "client/net/scene_convert.hpp"
#include "shared/wire/scene.hpp"

namespace saccade::net {

absl::StatusOr<std::string> Connection::GetModel(const std::string& id, std::uint32_t bytes) {
  std::string file;
  while (file.size() < bytes) {
    v1::GetModelRequest request;
    request.set_model_id(id);
    request.set_offset_bytes(static_cast<std::uint32_t>(file.size()));
    const auto piece =
        impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::GetModel, std::move(request));
    if (!piece.ok()) return piece.status();
    if (piece->data().empty() || piece->data().size() > bytes - file.size()) {
      return absl::DataLossError(absl::StrCat("model ", id, ": came torn"));
    }
    file += piece->data();
  }
  return file;
}

absl::StatusOr<ModelFacts> Connection::UploadModel(const std::string& name,
                                                   const std::string& glb) {
  return UploadInPieces(
      name, glb,
      [this](const v1::UploadModelRequest& request) {
        return impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::UploadModel, request);
      },
      [](std::size_t /*bytes*/) {});
}

absl::StatusOr<SceneObject> Connection::PutThing(const SceneObject& object) {
  v1::PutSceneObjectRequest request;
  *request.mutable_object() = wire::ToProto(object);
  const auto answer =
      impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::PutObject, std::move(request));
  if (!answer.ok()) return answer.status();
  return wire::FromProto(answer->object(), "object");
}

absl::Status Connection::RemoveThing(const std::string& id) {
  v1::RemoveSceneObjectRequest request;
  request.set_id(id);
  return impl_
      ->CallInSession(*impl_->scene_, &v1::SceneService::Stub::RemoveObject, std::move(request))
      .status();
}

absl::StatusOr<PlacedThing> Connection::PlaceThing(const SceneObject& object,
                                                   const std::optional<Eigen::Vector3d>& push) {
  const auto answer = impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::PlaceObject,
                                           PlaceRequest(object, push, std::nullopt));
  if (!answer.ok()) return answer.status();
  return FromProto(*answer);
}

absl::StatusOr<RegisteredThing> Connection::RegisterThing(const std::string& id,
                                                          const std::vector<PointPair>& pairs,
                                                          bool with_scale, bool accept) {
  const auto answer = impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::RegisterObject,
                                           RegisterRequest(id, pairs, with_scale, accept));
  if (!answer.ok()) return answer.status();
  return FromProto(*answer);
}

}  // namespace saccade::net
