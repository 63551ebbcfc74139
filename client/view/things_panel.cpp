// Things of the scene: what a click does, what there is, and how the selected one is moved.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <imgui.h>

#include <array>
#include <cmath>
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

/// Remembers where what was just drawn is, for tests.
void NoteButton(Desk& desk, const std::string& words) {
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  desk.state().things.buttons[words] = {low.x, low.y, high.x - low.x, high.y - low.y};
}

bool ThingButton(Desk& desk, const char* words, float width) {
  const bool pressed = ImGui::Button(words, {width, 0});
  NoteButton(desk, words);
  return pressed;
}

bool ClickChoice(Desk& desk, const std::string& words, const std::string& key, bool on) {
  const bool chosen = ImGui::Selectable(absl::StrCat(Types().Set(words), "###", key).c_str(), on);
  NoteButton(desk, words);
  return chosen;
}

std::string PlacesWords(const std::string& model) {
  const bool vowel =
      !model.empty() && std::string_view("aeiou").find(model[0]) != std::string::npos;
  return absl::StrCat("places ", vowel ? "an " : "a ", model);
}

std::string ClickWords(const ThingDesk& things) {
  switch (things.click) {
    case Click::kSelect:
      return "selects a thing";
    case Click::kMove:
      return "moves the selected thing there";
    case Click::kPlace:
      return PlacesWords(things.model);
  }
  return "";
}

/// Models of things that somebody can place: of the library, and what the server has besides.
std::set<std::string> Placeable(const Desk& desk) {
  std::set<std::string> names;
  for (const auto& [name, file] : desk.library) names.insert(name);
  for (const auto& model : desk.session().scene.scene().models) names.insert(model->name);
  return names;
}

void DrawChoice(Desk& desk) {
  const ThingDesk& things = desk.state().things;
  ImGui::TextUnformatted("A click");
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  const bool open = ImGui::BeginCombo("##click", Types().Set(ClickWords(things)).c_str(),
                                      ImGuiComboFlags_HeightLarge);
  if (!open) return NoteButton(desk, "A click");
  NoteAbove(desk);
  if (ClickChoice(desk, "selects a thing", "select", things.click == Click::kSelect)) {
    desk.ChooseThingClick(Click::kSelect);
  }
  if (ClickChoice(desk, "moves the selected thing there", "move", things.click == Click::kMove)) {
    desk.ChooseThingClick(Click::kMove);
  }
  for (const std::string& name : Placeable(desk)) {
    const bool on = things.click == Click::kPlace && things.model == name;
    if (ClickChoice(desk, PlacesWords(name), absl::StrCat("place ", name), on)) {
      desk.ChooseThingClick(Click::kPlace, name);
    }
  }
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
  const Eigen::Vector3d z = thing.parent_from_object.rotation * Eigen::Vector3d::UnitZ();
  const double turn_deg = std::atan2(z.x(), z.z()) * 180 / std::numbers::pi;
  return absl::StrFormat("%s: x %.3f  y %.3f  z %.3f %s, turn %.1f deg", thing.name, at.x(), at.y(),
                         at.z(), metric ? "m" : "units of the map", turn_deg);
}

void DrawRows(const PanelContext& context) {
  Desk& desk = context.desk;
  const Scene& scene = desk.session().scene.scene();
  if (scene.objects.empty()) {
    return Wrapped(Colours().dim,
                   "Nothing yet. Choose what a click places, then click in the map or the video.");
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
  const ThingDesk& things = desk.state().things;
  BeginPanel("things", rect, Colours().panel);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Things");
  ImGui::PopFont();
  DrawChoice(desk);
  Wrapped(things.warn ? Colours().warn : Colours().text, Types().Set(things.said));
  DrawMoves(context);
  const SceneObject* selected = desk.session().scene.scene().Find(things.selected_id);
  Wrapped(Colours().dim, selected != nullptr
                             ? Types().Set(PlaceWords(*selected, desk.session().metric()))
                             : "Select a thing to read its place.");
  ImGui::BeginChild("rows");
  DrawRows(context);
  ImGui::EndChild();
  EndPanel();
}

}  // namespace saccade::view
