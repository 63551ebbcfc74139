// Things of the scene: what a click does, what there is, and how the selected one is moved.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <string_view>

#include "client/tools/words.hpp"
#include "client/view/panels.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

using Click = ThingDesk::Click;

const char* WordOf(SceneMaterial material) {
  switch (material) {
    case SceneMaterial::kReal:
      return "real";
    case SceneMaterial::kVirtual:
      return "virtual";
    case SceneMaterial::kGuide:
      return "guide";
    case SceneMaterial::kHidden:
      return "hidden";
  }
  return "";
}

bool ClickChoice(Desk& desk, const std::string& words, const std::string& key, bool on) {
  const bool chosen = ImGui::Selectable(absl::StrCat(Types().Set(words), "###", key).c_str(), on);
  NoteButton(desk, words);
  return chosen;
}

constexpr const char* kInside = "inside";  // the library's model of a cabinet's
constexpr float kFlat_m = 1e-4f;           // of a picture, in depth

std::string PlacesWords(const std::string& model) {
  const bool vowel =
      !model.empty() && std::string_view("aeiou").find(model[0]) != std::string::npos;
  return absl::StrCat("places ", vowel ? "an " : "a ", model);
}

std::string InsideWords(const std::string& model) {
  return model == kInside ? "shows a cabinet's inside" : absl::StrCat("shows ", model);
}

const char* MeasureWords(SceneShape shape) {
  switch (shape) {
    case SceneShape::kPlane:
      return "marks a plane: 3 points";
    case SceneShape::kRoom:
      return "marks a room: 6 points";
    case SceneShape::kBox:
    case SceneShape::kModel:
      break;
  }
  return "marks a box: 2 corners";
}

std::string ClickWords(const ThingDesk& things) {
  switch (things.click) {
    case Click::kSelect:
      return "selects a thing";
    case Click::kMove:
      return "moves the selected thing there";
    case Click::kPlace:
      return PlacesWords(things.model);
    case Click::kInside:
      return InsideWords(things.model);
    case Click::kMeasure:
      return MeasureWords(things.shape);
    case Click::kOverlay:
      return tools::Overlays()[static_cast<std::size_t>(things.overlay)].words;
    case Click::kRegister:
      return "registers the selected: 4 points";
  }
  return "";
}

bool IsFlat(const SceneModel& model) {
  const auto [low, high] = std::ranges::minmax_element(
      model.mesh.positions, {}, [](const Eigen::Vector3f& one) { return one.z(); });
  return low != model.mesh.positions.end() && high->z() - low->z() < kFlat_m;
}

/// Models that somebody can let go on a floor, of the library and what the server has besides; and
/// those that are seen through a surface.
struct ModelChoice {
  std::set<std::string> placed, inside;
};
ModelChoice Choices(const Desk& desk) {
  ModelChoice choice;
  for (const auto& [name, file] : desk.library) choice.placed.insert(name);
  for (const auto& model : desk.session().scene.scene().models) {
    (IsFlat(*model) ? choice.inside : choice.placed).insert(model->name);
  }
  if (choice.placed.erase(kInside) > 0) choice.inside.insert(kInside);
  // Overlays come back as models: there they are by their clicks.
  for (const tools::OverlayWords& overlay : tools::Overlays()) {
    std::erase_if(choice.placed, [&](const std::string& name) {
      return !desk.library.contains(name) &&
             (name == overlay.name || name.starts_with(absl::StrCat(overlay.name, " ")));
    });
  }
  return choice;
}

void DrawActs(Desk& desk) {
  ThingDesk& things = desk.state().things;
  const auto choose = [&](const std::string& words, const std::string& key, bool on,
                          const std::function<void()>& set) {
    if (ClickChoice(desk, words, key, on)) set();
  };
  choose("selects a thing", "select", things.click == Click::kSelect,
         [&] { desk.ChooseThingClick(Click::kSelect); });
  choose("moves the selected thing there", "move", things.click == Click::kMove,
         [&] { desk.ChooseThingClick(Click::kMove); });
  for (const SceneShape shape : {SceneShape::kPlane, SceneShape::kBox, SceneShape::kRoom}) {
    const bool on = things.click == Click::kMeasure && things.shape == shape;
    choose(MeasureWords(shape), MeasureWords(shape), on, [&] {
      things.shape = shape;
      desk.ChooseThingClick(Click::kMeasure);
    });
  }
  choose("registers the selected: 4 points", "register", things.click == Click::kRegister,
         [&] { desk.ChooseThingClick(Click::kRegister); });
}

void DrawOverlayChoices(Desk& desk, const std::set<std::string>& inside) {
  ThingDesk& things = desk.state().things;
  for (const tools::OverlayWords& overlay : tools::Overlays()) {
    const bool on = things.click == Click::kOverlay && things.overlay == overlay.kind;
    if (!ClickChoice(desk, overlay.words, overlay.name, on)) continue;
    things.overlay = overlay.kind;
    desk.ChooseThingClick(Click::kOverlay);
  }
  for (const std::string& name : inside) {
    const bool on = things.click == Click::kInside && things.model == name;
    if (ClickChoice(desk, InsideWords(name), absl::StrCat("inside ", name), on)) {
      desk.ChooseThingClick(Click::kInside, name);
    }
  }
}

void DrawGroup(const char* words) {
  ImGui::Separator();
  ImGui::PushStyleColor(ImGuiCol_Text, Colours().dim);
  ImGui::TextUnformatted(words);
  ImGui::PopStyleColor();
}

void DrawChoice(Desk& desk) {
  const ThingDesk& things = desk.state().things;
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted("A click");
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  const bool open = ImGui::BeginCombo("##click", Types().Set(ClickWords(things)).c_str(),
                                      ImGuiComboFlags_HeightLargest);
  if (!open) return NoteButton(desk, "A click");
  NoteAbove(desk);
  const ModelChoice models = Choices(desk);
  DrawActs(desk);
  DrawGroup("Places");
  for (const std::string& name : models.placed) {
    const bool on = things.click == Click::kPlace && things.model == name;
    if (ClickChoice(desk, PlacesWords(name), absl::StrCat("place ", name), on)) {
      desk.ChooseThingClick(Click::kPlace, name);
    }
  }
  DrawGroup("Explains");
  DrawOverlayChoices(desk, models.inside);
  ImGui::EndCombo();
}

void DrawMoves(const PanelContext& context) {
  Desk& desk = context.desk;
  constexpr std::array<std::pair<tools::Way, const char*>, 4> kWays = {
      {{tools::Way::kLeft, "Left"},
       {tools::Way::kAway, "Away"},
       {tools::Way::kNearer, "Nearer"},
       {tools::Way::kRight, "Right"}}};
  const float gap = 4 * context.scale;
  const float width = (ImGui::GetContentRegionAvail().x - 3 * gap) / 4;
  for (const auto& [way, label] : kWays) {
    if (ThingButton(desk, label, width)) desk.PushThing(way);
    if (ImGui::IsItemHovered()) {
      ImGui::SetTooltip("push it until it touches; then it is lowered until it rests");
    }
    if (way != tools::Way::kRight) ImGui::SameLine(0, gap);
  }
  if (ThingButton(desk, "Turn <", width)) desk.TurnThing(-1);
  ImGui::SameLine(0, gap);
  if (ThingButton(desk, "Turn >", width)) desk.TurnThing(1);
  ImGui::SameLine(0, gap);
  if (ThingButton(desk, "Delete", width)) desk.RemoveThing();
  ImGui::SameLine(0, gap);
  if (ThingButton(desk, "Undo", width)) desk.UndoThing();
}

std::string PlaceWords(const SceneObject& thing, bool metric) {
  const Eigen::Vector3d& at = thing.parent_from_object.translation;
  const std::string on = thing.parent == SceneParent::kMarker
                             ? absl::StrCat(" on ", thing.marker_family, " ", thing.marker_id)
                             : "";
  const Eigen::Vector3d z = thing.parent_from_object.rotation * Eigen::Vector3d::UnitZ();
  const double turn_deg = std::atan2(z.x(), z.z()) * 180 / std::numbers::pi;
  return absl::StrFormat("%s%s: x %.3f  y %.3f  z %.3f %s, turn %.1f deg", thing.name, on, at.x(),
                         at.y(), at.z(), metric ? "m" : "units of the map", turn_deg);
}

void DrawRows(const PanelContext& context) {
  Desk& desk = context.desk;
  const Scene& scene = desk.session().scene.scene();
  if (scene.objects.empty()) {
    return Wrapped(Colours().dim, "Nothing yet: measure the room, or place a thing.");
  }
  for (const SceneObject& thing : scene.objects) {
    const bool on = thing.id == desk.state().things.selected_id;
    if (ClickChoice(desk, absl::StrCat(thing.name, " · ", WordOf(thing.material)), thing.id, on)) {
      desk.SelectThing(thing.id);
    }
  }
}

}  // namespace

void DrawThings(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  ThingDesk& things = desk.state().things;
  things.buttons.clear();
  BeginPanel("things", rect, Colours().panel, true);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Things");
  ImGui::PopFont();
  DrawChoice(desk);
  Wrapped(things.warn ? Colours().warn : Colours().text, Types().Set(things.said));
  DrawThingWork(context);
  DrawMoves(context);
  const SceneObject* selected = desk.session().scene.scene().Find(things.selected_id);
  Wrapped(Colours().dim, selected != nullptr
                             ? Types().Set(PlaceWords(*selected, desk.session().metric()))
                             : "Select a thing to read its place.");
  DrawMarkerFixing(context);
  const float least = 5 * ImGui::GetFrameHeight();
  ImGui::BeginChild("rows", {0, std::max(ImGui::GetContentRegionAvail().y, least)});
  DrawRows(context);
  ImGui::EndChild();
  EndPanel();
}

}  // namespace saccade::view
