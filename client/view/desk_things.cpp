// What clicks and keys do to things of the scene.
#include <absl/strings/str_cat.h>

#include <fstream>
#include <iterator>
#include <numbers>
#include <utility>

#include "client/tools/things.hpp"
#include "client/view/desk.hpp"
#include "client/view/patch.hpp"

namespace saccade::view {
namespace {

constexpr double kThingTurn_rad = std::numbers::pi / 12;

}  // namespace

void Desk::ChooseThingClick(ThingDesk::Click click, const std::string& model) {
  state_.things.click = click;
  state_.things.model = model;
  thing_work_.Begin();
}

void Desk::SelectThing(const std::string& id) {
  state_.things.selected_id = id;
  if (state_.things.click == ThingDesk::Click::kRegister) thing_work_.Begin();
}

std::span<const MarkerPose> Desk::markers() const {
  if (!live_ || picture_paused()) return {};
  return live_->facts->markers;
}

std::optional<Eigen::Vector3d> Desk::ThingPlace(const std::optional<tools::Landing>& landing,
                                                const RayTarget& ray) const {
  if (const auto hit = tools::HitSurface(session().scene.scene(), ray)) return hit->point_in_world;
  if (landing) return landing->point_in_world;
  return std::nullopt;
}

void Desk::UseThings(Pane pane, const std::optional<ThingSpot>& spot) {
  using Click = ThingDesk::Click;
  ThingDesk& things = state_.things;
  const Where where = NameOf(pane);
  if (!spot) return thing_work_.Refuse(where, WhyNoLanding(pane));
  if (things.click == Click::kSelect) {
    const SceneObject* picked = tools::PickThing(session().scene.scene(), spot->ray);
    things.selected_id = picked != nullptr ? picked->id : "";
    return thing_work_.Say(picked != nullptr ? "" : "No thing is there.");
  }
  if (things.busy) return;
  if (things.click == Click::kInside) {
    return thing_work_.ShowInside(where, *spot, things.model, LibraryFile(things.model));
  }
  if (things.click != Click::kMove && things.click != Click::kPlace) {
    return thing_work_.Click(where, *spot);
  }
  const std::optional<Eigen::Vector3d> place = ThingPlace(spot->landing, spot->ray);
  if (!place) return thing_work_.Refuse(where, WhyNoLanding(pane));
  Rigid3 start = tools::AboveFloor(*place, spot->ray.direction_in_world);
  if (things.click == Click::kMove) {
    const SceneObject* thing = Movable("moved");
    if (thing == nullptr) return;
    SceneObject moved = *thing;
    start.rotation = thing->parent_from_object.rotation;
    moved.parent_from_object = start;
    return thing_edits_.Place(moved, std::nullopt, thing_work_.Tell());
  }
  PlaceThing(std::exchange(things.model, ""), start);
  things.click = Click::kSelect;  // one click, one thing
}

std::string Desk::LibraryFile(const std::string& model) const {
  const auto file = library.find(model);
  if (file == library.end()) return "";
  std::ifstream in(file->second, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void Desk::PlaceThing(const std::string& model, const Rigid3& start) {
  const Scene& scene = session().scene.scene();
  SceneObject draft;
  draft.name = tools::FreeName(scene, model);
  draft.shape = SceneShape::kModel;
  draft.material = SceneMaterial::kVirtual;
  draft.parent_from_object = start;
  // The library's first: an overlay's model may have the same name.
  const std::string glb = LibraryFile(model);
  if (!glb.empty()) return thing_edits_.PlaceModel(model, glb, draft, thing_work_.Tell());
  for (const auto& known : scene.models) {
    if (known->name != model) continue;
    draft.model = known->id;
    return thing_edits_.Place(draft, std::nullopt, thing_work_.Tell());
  }
  thing_work_.Refuse("", "that model is not there, or cannot be read");
}

const SceneObject* Desk::Movable(const char* what) {
  const SceneObject* thing = session().scene.scene().Find(state_.things.selected_id);
  if (thing == nullptr) {
    thing_work_.Say(absl::StrCat("Not ", what, ": select a thing first."), true);
    return nullptr;
  }
  if (thing->material == SceneMaterial::kReal || thing->parent != SceneParent::kWorld) {
    thing_work_.Say(
        absl::StrCat("Not ", what, ": ", thing->name,
                     thing->parent == SceneParent::kWorld ? " is real: it stays where it is."
                                                          : " moves with what it is fixed to."),
        true);
    return nullptr;
  }
  return thing;
}

void Desk::PushThing(tools::Way way) {
  if (state_.things.busy) return;
  Eigen::Quaterniond eye = orbit_.world_from_camera().rotation;
  if (state_.main == Pane::kVideo) {
    const std::optional<tools::View> view = video_view();
    if (!view)
      return thing_work_.Say(absl::StrCat("Not pushed: ", WhyNoLanding(Pane::kVideo)), true);
    eye = view->world_from_camera.rotation;
  }
  const SceneObject* thing = Movable("pushed");
  if (thing == nullptr) return;
  thing_edits_.Place(*thing, tools::WayInWorld(eye, way), thing_work_.Tell());
}

void Desk::TurnThing(int sign) {
  if (state_.things.busy) return;
  const SceneObject* thing = Movable("turned");
  if (thing == nullptr) return;
  SceneObject turned = *thing;
  turned.parent_from_object = tools::TurnedBy(thing->parent_from_object, sign * kThingTurn_rad);
  thing_edits_.Place(turned, std::nullopt, thing_work_.Tell());
}

void Desk::RemoveThing() {
  if (state_.things.busy) return;
  if (state_.things.selected_id.empty()) {
    return thing_work_.Say("Not deleted: select a thing first.", true);
  }
  thing_edits_.Remove(state_.things.selected_id, thing_work_.Tell());
}

void Desk::UndoThing() {
  if (!state_.things.busy) thing_edits_.Undo(thing_work_.Tell());
}

}  // namespace saccade::view
