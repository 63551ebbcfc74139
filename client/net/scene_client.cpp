#include "client/net/scene_client.hpp"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <utility>

#include "client/net/channel.hpp"
#include "client/net/convert.hpp"
#include "client/net/model_upload.hpp"
#include "client/net/scene_convert.hpp"
#include "saccade/v1/scene.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/scene.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {
class SceneClient::Impl {
 public:
  explicit Impl(const ConnectionOptions& options)
      : options_(options),
        session_id_(options.session_id),
        channel_(MakeChannel(options)),
        session_(v1::SessionService::NewStub(channel_)),
        scene_(v1::SceneService::NewStub(channel_)) {}

  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + options_.deadline);
    Authorise(options_, context);
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (!status.ok()) return Explain(options_, status);
    return response;
  }
  template <typename Request, typename Response>
  absl::StatusOr<Response> Ask(grpc::Status (v1::SceneService::Stub::*method)(grpc::ClientContext*,
                                                                              const Request&,
                                                                              Response*),
                               Request request) {
    request.set_session_id(session_id_);
    return Call(*scene_, method, request);
  }

  absl::Status Join() {
    v1::JoinRequest request;
    request.set_display_name(options_.display_name);
    request.set_role(ToProto(options_.role));
    request.set_resume_session_id(session_id_);
    const auto joined = Call(*session_, &v1::SessionService::Stub::Join, request);
    if (!joined.ok()) return joined.status();
    session_id_ = joined->session_id();
    return absl::OkStatus();
  }

  const ConnectionOptions options_;
  std::string session_id_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> session_;
  const std::unique_ptr<v1::SceneService::Stub> scene_;
};

SceneClient::SceneClient(const ConnectionOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
SceneClient::~SceneClient() = default;

absl::Status SceneClient::Join() { return impl_->Join(); }
const std::string& SceneClient::session_id() const { return impl_->session_id_; }

absl::StatusOr<SceneList> SceneClient::List() {
  const auto answer = impl_->Ask(&v1::SceneService::Stub::ListScene, v1::ListSceneRequest());
  if (!answer.ok()) return answer.status();
  SceneList list;
  list.revision = answer->revision();
  for (const v1::SceneObject& message : answer->objects()) {
    absl::StatusOr<SceneObject> object = wire::FromProto(message, "objects");
    if (!object.ok()) return object.status();
    list.objects.push_back(*std::move(object));
  }
  for (const v1::SceneModelFacts& message : answer->models()) {
    absl::StatusOr<ModelFacts> model = FromProto(message);
    if (!model.ok()) return model.status();
    list.models.push_back(*std::move(model));
  }
  return list;
}

absl::StatusOr<SceneObject> SceneClient::Put(const SceneObject& object) {
  v1::PutSceneObjectRequest request;
  *request.mutable_object() = wire::ToProto(object);
  const auto answer = impl_->Ask(&v1::SceneService::Stub::PutObject, request);
  if (!answer.ok()) return answer.status();
  return wire::FromProto(answer->object(), "object");
}

absl::Status SceneClient::Remove(const std::string& id) {
  v1::RemoveSceneObjectRequest request;
  request.set_id(id);
  return impl_->Ask(&v1::SceneService::Stub::RemoveObject, request).status();
}

absl::StatusOr<PlacedThing> SceneClient::Place(const SceneObject& object,
                                               const std::optional<Eigen::Vector3d>& push,
                                               const std::optional<Eigen::Vector3d>& gravity) {
  const auto answer =
      impl_->Ask(&v1::SceneService::Stub::PlaceObject, PlaceRequest(object, push, gravity));
  if (!answer.ok()) return answer.status();
  return FromProto(*answer);
}

absl::StatusOr<ModelFacts> SceneClient::Upload(const std::string& name, const std::string& glb,
                                               const std::function<void(std::size_t)>& progress) {
  return UploadInPieces(
      name, glb,
      [this](const v1::UploadModelRequest& request) {
        return impl_->Ask(&v1::SceneService::Stub::UploadModel, request);
      },
      progress);
}

absl::StatusOr<RegisteredThing> SceneClient::Register(const std::string& id,
                                                      const std::vector<PointPair>& pairs,
                                                      bool with_scale, bool accept) {
  const auto answer = impl_->Ask(&v1::SceneService::Stub::RegisterObject,
                                 RegisterRequest(id, pairs, with_scale, accept));
  if (!answer.ok()) return answer.status();
  return FromProto(*answer);
}

}  // namespace saccade::net
