#include "server/app/scene_keeper.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/anchors/edit_checks.hpp"
#include "server/app/scene_places.hpp"
#include "server/scene/placement.hpp"
#include "server/scene/registration.hpp"
#include "server/scene/scene_file.hpp"
#include "shared/models/shapes.hpp"
#include "shared/scene/object_place.hpp"

namespace saccade {
namespace {

constexpr std::size_t kWaiting = 32;

std::span<const MarkerPose> AllOf(const std::shared_ptr<const std::vector<MarkerPose>>& markers) {
  return markers ? std::span<const MarkerPose>(*markers) : std::span<const MarkerPose>();
}

bool IsSolid(const SceneObject& object) {
  return object.material == SceneMaterial::kReal || object.material == SceneMaterial::kVirtual;
}

absl::Status NoObject(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("id: there is no object ", id, " (any more)"));
}

SceneContact ToContact(const Contact& contact) {
  return {contact.obstacle_id, contact.obstacle_name, contact.point_in_world,
          contact.normal_in_world, contact.moved_m};
}

void FailScene(SceneCommand& command, const absl::Status& status) {
  std::visit([&status](auto& one) { one.done(status); }, command);
}

}  // namespace

SceneKeeper::SceneKeeper(std::unique_ptr<SceneStore> store)
    : annotations_([] { return std::make_shared<const AnnotationList>(); }),
      store_(std::move(store)),
      runner_({.capacity = kWaiting + 1, .when_full = WhenFull::kRefuse},
              [this](SceneCommand command) { Run(std::move(command)); }) {}

absl::StatusOr<std::unique_ptr<SceneKeeper>> SceneKeeper::Open(
    const std::filesystem::path& directory) {
  std::unique_ptr<SceneStore> store;
  if (!directory.empty()) {
    absl::StatusOr<std::unique_ptr<SceneStore>> opened = SceneStore::Open(directory);
    if (!opened.ok()) return opened.status();
    store = *std::move(opened);
  }
  std::unique_ptr<SceneKeeper> keeper(new SceneKeeper(std::move(store)));
  if (absl::Status loaded = keeper->Load(); !loaded.ok()) return loaded;
  return keeper;
}

absl::Status SceneKeeper::Load() {
  Scene scene;
  scene.revision = 1;
  if (store_ != nullptr) {
    absl::StatusOr<SceneStore::Stored> stored = store_->LoadAll();
    if (!stored.ok()) return stored.status();
    scene.objects = std::move(stored->objects);
    for (SceneStore::StoredModel& model : stored->models) {
      auto read = MakeModel(model.id, model.name, std::move(model.bytes));
      if (!read.ok()) {
        return absl::DataLossError(absl::StrCat("scene.sqlite: model ", model.id, ": ",
                                                read.status().message(),
                                                "; restore the file, or move it away"));
      }
      scene.models.push_back(*std::move(read));
    }
  }
  std::shared_ptr<const Sight> sight = SightOf(scene);
  auto carried = std::make_shared<const CarriedSquareList>(CarriedOf(scene));
  const std::lock_guard lock(mutex_);
  carried_ = std::move(carried);
  scene_ = std::make_shared<const Scene>(std::move(scene));
  sight_ = std::move(sight);
  return absl::OkStatus();
}

std::shared_ptr<const Sight> SceneKeeper::sight() const {
  const std::lock_guard lock(mutex_);
  return sight_;
}

std::shared_ptr<const CarriedSquareList> SceneKeeper::carried() const {
  const std::lock_guard lock(mutex_);
  return carried_;
}

void SceneKeeper::SetMarkers(std::shared_ptr<const std::vector<MarkerPose>> markers) {
  const std::lock_guard lock(mutex_);
  markers_ = std::move(markers);
}

std::shared_ptr<const Scene> SceneKeeper::scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

void SceneKeeper::Publish(Scene next) {
  next.revision = scene()->revision + 1;
  std::shared_ptr<const Sight> sight = SightOf(next);
  CarriedSquareList carried = CarriedOf(next);
  const auto published = std::make_shared<const Scene>(std::move(next));
  {
    const std::lock_guard lock(mutex_);
    if (carried != *carried_) {
      carried_ = std::make_shared<const CarriedSquareList>(std::move(carried));
    }
    sight_ = std::move(sight);
    scene_ = published;
  }
  on_change_(published);
}

absl::Status SceneKeeper::Submit(SceneCommand command) {
  const std::lock_guard lock(submit_mutex_);
  if (stopping_) return absl::UnavailableError("the server is shutting down");
  if (waiting_ >= kWaiting) return BusyError("the scene is busy", 200'000'000);
  ++waiting_;
  return runner_.Post(std::move(command));
}

void SceneKeeper::Stop() {
  std::promise<void> drained;
  {
    const std::lock_guard lock(submit_mutex_);
    if (stopping_.exchange(true)) return;
    ++waiting_;
    // What waits is answered by the thread itself, at once; then it may end. There is always room
    // for one more than Submit takes.
    runner_.Post(RemoveSceneObject{"", [&drained](const absl::Status&) { drained.set_value(); }})
        .IgnoreError();
  }
  drained.get_future().wait();
  runner_.Stop();
}

void SceneKeeper::Run(SceneCommand command) {
  --waiting_;
  if (stopping_) return FailScene(command, absl::UnavailableError("the server is shutting down"));
  if (auto* put = std::get_if<PutSceneObject>(&command)) put->done(Put(std::move(put->object)));
  if (auto* removed = std::get_if<RemoveSceneObject>(&command)) removed->done(Remove(removed->id));
  if (auto* place = std::get_if<PlaceSceneObject>(&command)) place->done(PlaceOne(*place));
  if (auto* add = std::get_if<AddSceneModel>(&command)) {
    const auto done = add->done;
    done(AddModel(std::move(*add)));
  }
  if (auto* found = std::get_if<RegisterSceneObject>(&command)) found->done(RegisterOne(*found));
}

absl::Status SceneKeeper::CheckMarker(const SceneObject& object) const {
  const CarriedSquare one{object.marker_family, static_cast<int>(object.marker_id),
                          object.marker_side_m};
  if (absl::Status known = CheckCarried(one); !known.ok()) return known;
  for (const SceneObject& other : scene()->objects) {
    if (other.parent != SceneParent::kMarker || other.id == object.id) continue;
    if (other.marker_family == one.family && other.marker_id == object.marker_id &&
        other.marker_side_m != one.side_m) {
      return absl::InvalidArgumentError(absl::StrCat("marker.side_m: ", one.side_m, ", but '",
                                                     other.name, "' has ", other.marker_side_m,
                                                     " for the same marker; give the same"));
    }
  }
  return absl::OkStatus();
}

absl::Status SceneKeeper::CheckObject(const SceneObject& object) const {
  if (absl::Status valid = Validate(object); !valid.ok()) return valid;
  if (object.shape == SceneShape::kModel && scene()->Model(object.model) == nullptr) {
    return absl::NotFoundError(
        absl::StrCat("model: there is no model ", object.model, "; upload it first"));
  }
  if (object.parent == SceneParent::kMarker) return CheckMarker(object);
  if (object.parent != SceneParent::kAnchor) return absl::OkStatus();
  const std::shared_ptr<const AnnotationList> annotations = annotations_();
  const bool known =
      std::any_of(annotations->begin(), annotations->end(),
                  [&object](const Annotation& one) { return one.id == object.annotation_id; });
  if (known) return absl::OkStatus();
  return absl::NotFoundError("annotation_id: there is no such annotation (any more)");
}

absl::StatusOr<SceneObject> SceneKeeper::Put(SceneObject object) {
  if (absl::Status valid = CheckObject(object); !valid.ok()) return valid;
  object.parent_from_object.rotation.normalize();
  Scene next = *scene();
  auto old = std::find_if(next.objects.begin(), next.objects.end(),
                          [&object](const SceneObject& one) { return one.id == object.id; });
  if (object.id.empty()) {
    if (next.objects.size() >= kMostObjects) {
      return absl::ResourceExhaustedError(
          absl::StrCat("object: there are ", kMostObjects, " already; remove some"));
    }
    object.id = MakeUuid();
    old = next.objects.insert(next.objects.end(), object);
  } else if (old == next.objects.end()) {
    return NoObject(object.id);
  }
  if (store_ != nullptr) {
    if (absl::Status kept = store_->PutObject(object); !kept.ok()) return kept;
  }
  *old = object;
  Publish(std::move(next));
  return object;
}

absl::Status SceneKeeper::Remove(const std::string& id) {
  Scene next = *scene();
  if (std::erase_if(next.objects, [&id](const SceneObject& one) { return one.id == id; }) == 0) {
    return NoObject(id);
  }
  if (store_ != nullptr) {
    if (absl::Status kept = store_->RemoveObject(id); !kept.ok()) return kept;
  }
  Publish(std::move(next));
  return absl::OkStatus();
}

absl::StatusOr<PlacedObject> SceneKeeper::PlaceOne(const PlaceSceneObject& command) {
  if (absl::Status valid = CheckObject(command.object); !valid.ok()) return valid;
  if (command.object.parent != SceneParent::kWorld) {
    return absl::InvalidArgumentError("object: what is placed stands in the world");
  }
  const std::shared_ptr<const Scene> scene = this->scene();
  const std::shared_ptr<const AnnotationList> annotations = annotations_();
  std::shared_ptr<const std::vector<MarkerPose>> markers;
  {
    const std::lock_guard lock(mutex_);
    markers = markers_;
  }
  std::vector<Obstacle> obstacles;
  for (const SceneObject& object : scene->objects) {
    const std::optional<Rigid3> pose = WorldFromObject(object, *annotations, AllOf(markers));
    if (!IsSolid(object) || !pose || object.id == command.object.id) continue;
    Obstacle obstacle{object.id, object.name, {}};
    Append(MeshOf(object, scene->Model(object.model).get()), *pose, 1.0, obstacle.in_world);
    obstacles.push_back(std::move(obstacle));
  }
  const Body body(MeshOf(command.object, scene->Model(command.object.model).get()));
  PlacementRequest request;
  request.world_from_body = command.object.parent_from_object;
  request.gravity = command.gravity;
  request.push = command.push;
  request.hand_m = command.hand_m;
  const absl::StatusOr<Placement> placed =
      Place(CollisionScene(std::move(obstacles)), body, request);
  if (!placed.ok()) return placed.status();
  SceneObject object = command.object;
  object.parent_from_object = placed->world_from_body;
  absl::StatusOr<SceneObject> put = Put(std::move(object));
  if (!put.ok()) return put.status();
  PlacedObject result{*std::move(put), std::nullopt, ToContact(placed->support), placed->slid_m,
                      std::nullopt};
  if (placed->stop) result.stop = ToContact(*placed->stop);
  if (placed->slide_stop) result.slide_stop = ToContact(*placed->slide_stop);
  return result;
}

absl::StatusOr<std::shared_ptr<const SceneModel>> SceneKeeper::AddModel(AddSceneModel command) {
  Scene next = *scene();
  if (auto same = next.Model(command.id)) return same;
  std::size_t bytes = command.bytes.size();
  for (const auto& model : next.models) bytes += model->file->size();
  if (next.models.size() >= kMostModels || bytes > kMostModelBytes) {
    return absl::ResourceExhaustedError(absl::StrCat("model: at most ", kMostModels, " of ",
                                                     kMostModelBytes, " bytes in all are kept"));
  }
  absl::StatusOr<std::shared_ptr<const SceneModel>> model =
      MakeModel(command.id, command.name, std::move(command.bytes));
  if (!model.ok()) return model.status();
  if (store_ != nullptr) {
    absl::Status kept = store_->PutModel({(*model)->id, (*model)->name, *(*model)->file});
    if (!kept.ok()) return kept;
  }
  next.models.push_back(*model);
  Publish(std::move(next));
  return *model;
}

absl::StatusOr<RegisteredObject> SceneKeeper::RegisterOne(const RegisterSceneObject& command) {
  const std::shared_ptr<const Scene> scene = this->scene();
  const SceneObject* object = scene->Find(command.id);
  if (object == nullptr) return NoObject(command.id);
  const bool model = object->shape == SceneShape::kModel;
  if (command.with_scale && !model) {
    return absl::InvalidArgumentError("with_scale: only a model has a scale");
  }
  if (object->parent != SceneParent::kWorld) {
    return absl::FailedPreconditionError("id: it is fixed to something; let it stand in the world");
  }
  // Points of a model are told before its scale; without one to find it stays as it is.
  const double scale = model && !command.with_scale ? object->scale : 1.0;
  std::vector<PointPair> pairs;
  for (const auto& [in_object, in_world] : command.object_and_world) {
    pairs.push_back({scale * in_object, in_world});
  }
  absl::StatusOr<Registration> found = Register(pairs, {.with_scale = command.with_scale});
  if (!found.ok()) return found.status();
  RegisteredObject result{*object, found->rms_m, found->left_out_rms_m, found->errors_m,
                          found->left_out_errors_m};
  result.object.parent_from_object = {found->map_from_model.rotation,
                                      found->map_from_model.translation};
  if (command.with_scale) result.object.scale = found->map_from_model.scale;
  if (!command.accept) return result;
  absl::StatusOr<SceneObject> put = Put(result.object);
  if (!put.ok()) return put.status();
  result.object = *std::move(put);
  return result;
}

}  // namespace saccade
