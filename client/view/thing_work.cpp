#include "client/view/thing_work.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "client/tools/things.hpp"
#include "shared/models/gltf_reader.hpp"
#include "shared/scene/object_place.hpp"

namespace saccade::view {
namespace {

using Click = ThingDesk::Click;

std::string IsThere(const SceneObject& thing) {
  return absl::StrCat(thing.name, " is there; Delete or Undo takes it away");
}

double HeightOf(const TriangleMesh& mesh) {
  if (mesh.positions.empty()) return 0;
  const auto [low, high] = std::ranges::minmax_element(
      mesh.positions, {}, [](const Eigen::Vector3f& one) { return one.y(); });
  return high->y() - low->y();
}

}  // namespace

std::string SizeWords(const SceneObject& thing) {
  const Eigen::Vector3d& size = thing.size_m;
  return thing.shape == SceneShape::kPlane
             ? absl::StrFormat("%s: %.3f × %.3f m", thing.name, size.x(), size.z())
             : absl::StrFormat("%s: %.3f × %.3f × %.3f m", thing.name, size.x(), size.y(),
                               size.z());
}

void ThingWork::Say(const std::string& words, bool warn) {
  things().said = words;
  things().warn = warn;
  ++things().tells;
}

void ThingWork::Refuse(const Where& where, const std::string& why) {
  Say(absl::StrCat("Not done: ", why), true);
  if (!where.empty()) desk_.Refuse(where, things().said, MonotonicNow());
}

session::ThingEdits::Done ThingWork::Tell(const Where& where) {
  things().busy = true;
  return [this, where](const absl::StatusOr<session::ThingEdits::Told>& told) {
    things().busy = false;
    if (!told.ok()) return Refuse(where, std::string(told.status().message()));
    things().selected_id = told->id;
    Say(told->words);
  };
}

std::string ThingWork::Hint() const {
  switch (things().click) {
    case Click::kSelect:
      return "Click a thing to select it.";
    case Click::kMove:
      return "Click where the selected thing is to stand.";
    case Click::kPlace:
      return absl::StrCat("Click where the ", things().model, " is to stand.");
    case Click::kInside:
      return "Click the middle of what it is to be seen through.";
    case Click::kMeasure:
      return things().measuring.Hint(things().shape);
    case Click::kOverlay:
      return things().overlaying.Hint(things().overlay);
    case Click::kRegister:
      return things().registering.Step(scene());
  }
  return "";
}

void ThingWork::Begin() {
  things().measuring.Clear();
  things().overlaying.Clear();
  things().registering.Begin(things().click == Click::kRegister ? things().selected_id : "");
  ShowPoints();
  Say(Hint());
}

bool ThingWork::Cancel() {
  const bool begun =
      !things().measuring.points().empty() || has_way() || !things().registering.thing_id().empty();
  if (!begun) return false;
  things().click = Click::kSelect;
  Begin();
  return true;
}

void ThingWork::ShowPoints() {
  session::AnnotationBook& book = session_.state().annotations;
  for (const std::string& id : pins_) book.RemovePending(id);
  pins_.clear();
  std::vector<Eigen::Vector3d> points = things().measuring.points();
  if (points.empty()) points = things().overlaying.points();
  if (points.empty()) points = things().registering.points();
  for (const Eigen::Vector3d& point : points) {
    Annotation pin;
    pin.id = net::RandomUuid();
    pin.shape = AnnotationShape::kPin;
    pin.number = static_cast<std::uint32_t>(pins_.size() + 1);
    pin.color_rgba = desk_.color_rgba;
    pin.anchor.point_in_world = point;
    pin.anchor.state = AnchorState::kPaused;
    pins_.push_back(pin.id);
    book.AddPending(std::move(pin));
  }
}

void ThingWork::Click(const Where& where, const ThingSpot& spot) {
  if (things().click == Click::kMeasure) return Measure(where, spot);
  if (things().click == Click::kOverlay) return Lay(where, spot);
  if (things().click == Click::kRegister) return Pair(where, spot);
}

void ThingWork::Measure(const Where& where, const ThingSpot& spot) {
  const auto made = things().measuring.Click(things().shape, spot.landing, spot.view, scene());
  ShowPoints();
  if (!made.ok()) return Refuse(where, std::string(made.status().message()));
  if (!made->has_value()) return Say(Hint());
  things().click = Click::kSelect;
  edits_.Put(**made, SizeWords, Tell(where));
}

std::optional<tools::OverlayPoint> ThingWork::PointOf(const ThingSpot& spot) const {
  if (const auto hit = tools::HitSurface(scene(), spot.ray)) {
    return tools::OverlayPoint{hit->point_in_world, hit->normal_in_world, hit};
  }
  if (!spot.landing) return std::nullopt;
  const Eigen::Vector3d towards = -spot.ray.direction_in_world.normalized();
  return tools::OverlayPoint{spot.landing->point_in_world,
                             spot.landing->normal_in_world.value_or(towards)};
}

void ThingWork::Lay(const Where& where, const ThingSpot& spot) {
  const std::optional<tools::OverlayPoint> point = PointOf(spot);
  if (!point) return Refuse(where, tools::kUnmeasured);
  const auto made = things().overlaying.Click(things().overlay, *point, scene());
  ShowPoints();
  if (!made.ok()) return Refuse(where, std::string(made.status().message()));
  if (!made->has_value()) return Say(Hint());
  Laid(**made, where);
}

void ThingWork::Finish(const Where& where) {
  if (!has_way() || things().busy) return;
  const auto made = things().overlaying.Finish(things().overlay, scene());
  if (!made.ok()) return Refuse(where, std::string(made.status().message()));
  ShowPoints();
  Laid(*made, where);
}

void ThingWork::Laid(const tools::Overlay& overlay, const Where& where) {
  things().click = Click::kSelect;
  edits_.PutModel(overlay.thing.name, overlay.file, overlay.thing, IsThere, Tell(where));
}

void ThingWork::ShowInside(const Where& where, const ThingSpot& spot, const std::string& model,
                           const std::string& file) {
  const std::optional<tools::OverlayPoint> point = PointOf(spot);
  if (!point) return Refuse(where, tools::kUnmeasured);
  SceneObject draft;
  draft.name = tools::FreeName(scene(), model);
  draft.shape = SceneShape::kModel;
  draft.material = SceneMaterial::kHidden;
  draft.parent_from_object = tools::AboveFloor(point->point_in_world, -point->normal_in_world);
  draft.parent_from_object.translation = point->point_in_world;  // of its middle; its base is lower
  double& y = draft.parent_from_object.translation.y();
  things().click = Click::kSelect;
  for (const auto& known : scene().models) {
    if (!file.empty() || known->name != model) continue;
    draft.model = known->id;
    y += HeightOf(known->mesh) / 2;
    return edits_.Put(draft, IsThere, Tell(where));
  }
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(file);
  if (!mesh.ok()) return Refuse(where, std::string(mesh.status().message()));
  y += HeightOf(*mesh) / 2;
  edits_.PutModel(model, file, draft, IsThere, Tell(where));
}

bool ThingWork::WithScale() const {
  const SceneObject* thing = scene().Find(things().registering.thing_id());
  return thing != nullptr && thing->shape == SceneShape::kModel && !session_.state().metric();
}

void ThingWork::Pair(const Where& where, const ThingSpot& spot) {
  tools::Registering& registering = things().registering;
  const auto took = registering.Click(scene(), spot.view, spot.pixel, spot.landing, spot.near_px);
  if (!took.ok()) return Refuse(where, std::string(took.status().message()));
  Say(Hint());
  if (*took != tools::Registering::Took::kPair) return;
  ShowPoints();
  Solve();
}

void ThingWork::Solve() {
  tools::Registering& registering = things().registering;
  if (registering.pairs().size() < tools::kLeastPairs) return;
  things().busy = true;
  edits_.TryRegister(registering.thing_id(), registering.pairs(), WithScale(),
                     [this](const absl::StatusOr<net::RegisteredThing>& found) {
                       things().busy = false;
                       tools::Registering& asked = things().registering;
                       asked.result.reset();
                       asked.why = found.ok() ? "" : std::string(found.status().message());
                       if (found.ok() && found->object.id == asked.thing_id()) {
                         asked.result = *found;
                       }
                     });
}

void ThingWork::Accept() {
  const tools::Registering& registering = things().registering;
  if (things().busy || !registering.result) return;
  const session::ThingEdits::Done tell = Tell();
  edits_.Register(registering.thing_id(), registering.pairs(), WithScale(),
                  [this, tell](const absl::StatusOr<session::ThingEdits::Told>& told) {
                    if (told.ok()) Cancel();
                    tell(told);
                  });
}

void ThingWork::DropPair(std::size_t index) {
  if (things().busy) return;
  things().registering.Drop(index);
  ShowPoints();
  Say(Hint());
  Solve();
}

std::optional<Rigid3> ThingWork::PlaceOf(const SceneObject& thing,
                                         std::span<const MarkerPose> markers) const {
  return WorldFromObject(thing, session_.state().annotations.List(), markers);
}

void ThingWork::FixToMarker(std::span<const MarkerPose> markers) {
  if (things().busy) return;
  const SceneObject* thing = scene().Find(things().selected_id);
  if (thing == nullptr) return Refuse("", "select the thing in the list first");
  const std::optional<Rigid3> place = PlaceOf(*thing, markers);
  if (!place) return Refuse("", absl::StrCat("nobody knows where ", thing->name, " is now"));
  Say(absl::StrCat("Looking for ", things().marker.family, " ", things().marker.id, "."));
  markers_.Fix(*thing, things().marker, *place, Tell());
}

void ThingWork::LetGo(std::span<const MarkerPose> markers) {
  if (things().busy) return;
  const SceneObject* thing = scene().Find(things().selected_id);
  const std::optional<Rigid3> place = thing == nullptr ? std::nullopt : PlaceOf(*thing, markers);
  if (!place) return Refuse("", "nobody knows where it is now");
  markers_.LetGo(*thing, *place, Tell());
}

}  // namespace saccade::view
