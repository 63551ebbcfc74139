#include "server/rpc/scene_service.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/identity/secret.hpp"
#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/scene.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

v1::SceneContact ToProto(const SceneContact& contact) {
  v1::SceneContact message;
  message.set_object_id(contact.object_id);
  message.set_object_name(contact.object_name);
  *message.mutable_point_in_world_m() = wire::ToProto(contact.point_in_world);
  *message.mutable_normal_in_world() = wire::ToProto(contact.normal_in_world);
  message.set_moved_m(contact.moved_m);
  return message;
}

absl::StatusOr<PlaceSceneObject> ToCommand(const v1::PlaceSceneObjectRequest& request) {
  PlaceSceneObject command;
  absl::StatusOr<SceneObject> object = wire::FromProto(request.object(), "object");
  if (!object.ok()) return object.status();
  command.object = *std::move(object);
  if (request.has_push_in_world()) {
    absl::StatusOr<Eigen::Vector3d> push =
        wire::FromProto(request.push_in_world(), "push_in_world");
    if (!push.ok()) return push.status();
    command.push = *push;
    command.hand_m = request.hand_m();
  }
  if (!request.has_gravity_in_world()) return command;
  absl::StatusOr<Eigen::Vector3d> gravity =
      wire::FromProto(request.gravity_in_world(), "gravity_in_world");
  if (!gravity.ok()) return gravity.status();
  command.gravity = *gravity;
  return command;
}

absl::StatusOr<RegisterSceneObject> ToCommand(const v1::RegisterSceneObjectRequest& request) {
  RegisterSceneObject command;
  if (absl::Status uuid = wire::CheckUuid(request.id(), "id"); !uuid.ok()) return uuid;
  if (request.correspondences_size() > SceneService::kMostCorrespondences) {
    return absl::InvalidArgumentError(
        absl::StrCat("correspondences: ", request.correspondences_size(), "; at most ",
                     SceneService::kMostCorrespondences));
  }
  command.id = request.id();
  command.with_scale = request.with_scale();
  command.accept = request.accept();
  for (int i = 0; i < request.correspondences_size(); ++i) {
    const v1::SceneCorrespondence& one = request.correspondences(i);
    const std::string at = absl::StrCat("correspondences[", i, "].");
    absl::StatusOr<Eigen::Vector3d> in_object =
        wire::FromProto(one.point_in_object_m(), absl::StrCat(at, "point_in_object_m"));
    if (!in_object.ok()) return in_object.status();
    absl::StatusOr<Eigen::Vector3d> in_world =
        wire::FromProto(one.point_in_world_m(), absl::StrCat(at, "point_in_world_m"));
    if (!in_world.ok()) return in_world.status();
    command.object_and_world.emplace_back(*in_object, *in_world);
  }
  return command;
}

void Fill(const RegisteredObject& result, v1::RegisterSceneObjectResponse& response) {
  *response.mutable_object() = wire::ToProto(result.object);
  response.set_rms_mm(1e3 * result.rms_m);
  response.set_left_out_rms_mm(1e3 * result.left_out_rms_m);
  for (const double error_m : result.errors_m) response.add_errors_mm(1e3 * error_m);
  for (const double error_m : result.left_out_errors_m) {
    response.add_left_out_errors_mm(1e3 * error_m);
  }
}

}  // namespace

SceneService::SceneService(Backend& backend, Gatekeeper& gate) : backend_(backend), gate_(gate) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "SceneService/ListScene", this, &SceneService::ListScene));
  MarkMethodCallback(1, Early(gate, "SceneService/PutObject", this, &SceneService::PutObject));
  MarkMethodCallback(2,
                     Early(gate, "SceneService/RemoveObject", this, &SceneService::RemoveObject));
  MarkMethodCallback(3, Early(gate, "SceneService/PlaceObject", this, &SceneService::PlaceObject));
  MarkMethodCallback(4, Early(gate, "SceneService/UploadModel", this, &SceneService::UploadModel));
  MarkMethodCallback(5, Early(gate, "SceneService/GetModel", this, &SceneService::GetModel));
  MarkMethodCallback(
      6, Early(gate, "SceneService/RegisterObject", this, &SceneService::RegisterObject));
}

grpc::ServerUnaryReactor* SceneService::ListScene(Context* context,
                                                  const v1::ListSceneRequest* request,
                                                  v1::ListSceneResponse* response) {
  UnaryCall call(*context, "SceneService/ListScene", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  const std::shared_ptr<const Scene> scene = backend_.scene();
  response->set_revision(scene->revision);
  *response->mutable_light() = wire::ToProto(backend_.light());
  if (request->known_revision() != scene->revision) {
    for (const SceneObject& object : scene->objects) {
      *response->add_objects() = wire::ToProto(object);
    }
    for (const auto& model : scene->models) *response->add_models() = wire::ToProto(*model);
  }
  call.set_log(UnaryCall::Log::kNothing);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* SceneService::PutObject(Context* context,
                                                  const v1::PutSceneObjectRequest* request,
                                                  v1::PutSceneObjectResponse* response) {
  UnaryCall call(*context, "SceneService/PutObject", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::StatusOr<SceneObject> object = wire::FromProto(request->object(), "object");
  if (!object.ok()) return call.Finish(object.status());
  return call.Submitted(backend_.SubmitScene(PutSceneObject{
      *std::move(object), call.Answer<SceneObject>([response](const SceneObject& put) {
        *response->mutable_object() = wire::ToProto(put);
      })}));
}

grpc::ServerUnaryReactor* SceneService::RemoveObject(Context* context,
                                                     const v1::RemoveSceneObjectRequest* request,
                                                     v1::RemoveSceneObjectResponse* /*response*/) {
  UnaryCall call(*context, "SceneService/RemoveObject", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (absl::Status uuid = wire::CheckUuid(request->id(), "id"); !uuid.ok()) {
    return call.Finish(uuid);
  }
  return call.Submitted(backend_.SubmitScene(RemoveSceneObject{request->id(), call.Answer()}));
}

grpc::ServerUnaryReactor* SceneService::PlaceObject(Context* context,
                                                    const v1::PlaceSceneObjectRequest* request,
                                                    v1::PlaceSceneObjectResponse* response) {
  UnaryCall call(*context, "SceneService/PlaceObject", UnaryCall::Log::kAll);
  // As dear as a picture that is pinned up.
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kStill, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::StatusOr<PlaceSceneObject> command = ToCommand(*request);
  if (!command.ok()) return call.Finish(command.status());
  command->done = call.Answer<PlacedObject>([response](const PlacedObject& placed) {
    *response->mutable_object() = wire::ToProto(placed.object);
    if (placed.stop) *response->mutable_stop() = ToProto(*placed.stop);
    if (placed.slide_stop) *response->mutable_slide_stop() = ToProto(*placed.slide_stop);
    response->set_slid_m(placed.slid_m);
    *response->mutable_support() = ToProto(placed.support);
  });
  return call.Submitted(backend_.SubmitScene(*std::move(command)));
}

grpc::ServerUnaryReactor* SceneService::UploadModel(Context* context,
                                                    const v1::UploadModelRequest* request,
                                                    v1::UploadModelResponse* response) {
  UnaryCall call(*context, "SceneService/UploadModel", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::Status valid = wire::CheckUuid(request->upload_id(), "upload_id");
  if (valid.ok()) valid = wire::CheckText(request->name(), 100, "name");
  if (valid.ok() && request->name().empty()) {
    valid = absl::InvalidArgumentError("name: is empty; give the model a name");
  }
  if (!valid.ok()) return call.Finish(valid);
  absl::StatusOr<ModelUploads::Progress> progress =
      uploads_.Take({session->participant_id, request->upload_id(), request->name(),
                     request->total_bytes(), request->offset_bytes(), request->data()},
                    MonotonicNow());
  if (!progress.ok()) return call.Finish(progress.status());
  response->set_received_bytes(static_cast<std::uint32_t>(progress->received));
  if (!progress->whole) {
    call.set_log(UnaryCall::Log::kNothing);
    return call.Finish(absl::OkStatus());
  }
  std::string id = Sha256Hex(*progress->whole);
  return call.Submitted(backend_.SubmitScene(
      AddSceneModel{std::move(id), request->name(), *std::move(progress->whole),
                    call.Answer<std::shared_ptr<const SceneModel>>(
                        [response](const std::shared_ptr<const SceneModel>& model) {
                          *response->mutable_model() = wire::ToProto(*model);
                        })}));
}

grpc::ServerUnaryReactor* SceneService::GetModel(Context* context,
                                                 const v1::GetModelRequest* request,
                                                 v1::GetModelResponse* response) {
  UnaryCall call(*context, "SceneService/GetModel", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  const std::shared_ptr<const SceneModel> model = backend_.scene()->Model(request->model_id());
  if (model == nullptr) {
    return call.Finish(absl::NotFoundError("model_id: there is no such model (any more)"));
  }
  const std::string& file = *model->file;
  if (request->offset_bytes() > file.size()) {
    return call.Finish(absl::InvalidArgumentError(absl::StrCat(
        "offset_bytes: ", request->offset_bytes(), " of ", file.size(), "; give less")));
  }
  response->set_total_bytes(static_cast<std::uint32_t>(file.size()));
  response->set_data(file.substr(request->offset_bytes(), kMostSent));
  call.set_log(UnaryCall::Log::kNothing);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* SceneService::RegisterObject(
    Context* context, const v1::RegisterSceneObjectRequest* request,
    v1::RegisterSceneObjectResponse* response) {
  UnaryCall call(*context, "SceneService/RegisterObject", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::StatusOr<RegisterSceneObject> command = ToCommand(*request);
  if (!command.ok()) return call.Finish(command.status());
  command->done = call.Answer<RegisteredObject>(
      [response](const RegisteredObject& found) { Fill(found, *response); });
  return call.Submitted(backend_.SubmitScene(*std::move(command)));
}

}  // namespace saccade
