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

void Desk::SayOfThings(const std::string& words, bool warn) {
  state_.things.said = words;
  state_.things.warn = warn;
}

session::ThingEdits::Done Desk::TellOfThings() {
  state_.things.busy = true;
  return [this](const absl::StatusOr<session::ThingEdits::Told>& told) {
    state_.things.busy = false;
    if (!told.ok()) {
      return SayOfThings(absl::StrCat("Not done: ", told.status().message()), true);
    }
    state_.things.selected_id = told->id;
    SayOfThings(told->words);
  };
}

void Desk::ChooseThingClick(ThingDesk::Click click, const std::string& model) {
  state_.things.click = click;
  state_.things.model = model;
  switch (click) {
    case ThingDesk::Click::kSelect:
      return SayOfThings("Click a thing to select it.");
    case ThingDesk::Click::kMove:
      return SayOfThings("Click where the selected thing is to stand.");
    case ThingDesk::Click::kPlace:
      return SayOfThings(absl::StrCat("Click where the ", model, " is to stand."));
  }
}

std::optional<Eigen::Vector3d> Desk::ThingPlace(const std::optional<tools::Landing>& landing,
                                                const RayTarget& ray) const {
  if (const auto hit = tools::HitSurface(session().scene.scene(), ray)) return hit->point_in_world;
  if (landing) return landing->point_in_world;
  return std::nullopt;
}

void Desk::UseThings(Pane pane, const std::optional<tools::Landing>& landing,
                     const std::optional<RayTarget>& ray) {
  ThingDesk& things = state_.things;
  const auto refuse = [&](const std::string& why) {
    SayOfThings(absl::StrCat("Not done: ", why), true);
    state_.Refuse(NameOf(pane), things.said, MonotonicNow());
  };
  if (!ray) return refuse(WhyNoLanding(pane));
  if (things.click == ThingDesk::Click::kSelect) {
    const SceneObject* picked = tools::PickThing(session().scene.scene(), *ray);
    things.selected_id = picked != nullptr ? picked->id : "";
    return SayOfThings(picked != nullptr ? "" : "No thing is there.");
  }
  if (things.busy) return;
  const std::optional<Eigen::Vector3d> place = ThingPlace(landing, *ray);
  if (!place) return refuse(WhyNoLanding(pane));
  Rigid3 start = tools::AboveFloor(*place, ray->direction_in_world);
  if (things.click == ThingDesk::Click::kMove) {
    const SceneObject* thing = Movable("moved");
    if (thing == nullptr) return;
    SceneObject moved = *thing;
    start.rotation = thing->parent_from_object.rotation;
    moved.parent_from_object = start;
    return thing_edits_.Place(moved, std::nullopt, TellOfThings());
  }
  PlaceThing(std::exchange(things.model, ""), start);
  things.click = ThingDesk::Click::kSelect;  // one click, one thing
}

void Desk::PlaceThing(const std::string& model, const Rigid3& start) {
  const Scene& scene = session().scene.scene();
  SceneObject draft;
  draft.name = tools::FreeName(scene, model);
  draft.shape = SceneShape::kModel;
  draft.material = SceneMaterial::kVirtual;
  draft.parent_from_object = start;
  for (const auto& known : scene.models) {
    if (known->name != model) continue;
    draft.model = known->id;
    return thing_edits_.Place(draft, std::nullopt, TellOfThings());
  }
  const auto file = library.find(model);
  if (file == library.end()) return SayOfThings("Not done: that model is not there.", true);
  std::ifstream in(file->second, std::ios::binary);
  const std::string glb{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (glb.empty()) {
    return SayOfThings(absl::StrCat("Not done: ", file->second.string(), " cannot be read."), true);
  }
  thing_edits_.PlaceModel(model, glb, draft, TellOfThings());
}

const SceneObject* Desk::Movable(const char* what) {
  const SceneObject* thing = session().scene.scene().Find(state_.things.selected_id);
  if (thing == nullptr) {
    SayOfThings(absl::StrCat("Not ", what, ": select a thing first."), true);
    return nullptr;
  }
  if (thing->material == SceneMaterial::kReal || thing->parent != SceneParent::kWorld) {
    SayOfThings(
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
    if (!view) return SayOfThings(absl::StrCat("Not pushed: ", WhyNoLanding(Pane::kVideo)), true);
    eye = view->world_from_camera.rotation;
  }
  const SceneObject* thing = Movable("pushed");
  if (thing == nullptr) return;
  thing_edits_.Place(*thing, tools::WayInWorld(eye, way), TellOfThings());
}

void Desk::TurnThing(int sign) {
  if (state_.things.busy) return;
  const SceneObject* thing = Movable("turned");
  if (thing == nullptr) return;
  SceneObject turned = *thing;
  turned.parent_from_object = tools::TurnedBy(thing->parent_from_object, sign * kThingTurn_rad);
  thing_edits_.Place(turned, std::nullopt, TellOfThings());
}

void Desk::RemoveThing() {
  if (state_.things.busy) return;
  if (state_.things.selected_id.empty()) {
    return SayOfThings("Not deleted: select a thing first.", true);
  }
  thing_edits_.Remove(state_.things.selected_id, TellOfThings());
}

void Desk::UndoThing() {
  if (!state_.things.busy) thing_edits_.Undo(TellOfThings());
}

}  // namespace saccade::view
