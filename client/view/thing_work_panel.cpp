// Things: what several clicks make, and the marker that one moves with.
#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <optional>

#include "client/view/panels.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

// What a detector of grey pictures knows (server/markers).
constexpr std::array<const char*, 5> kFamilies = {"apriltag36h11", "apriltag25h9", "aruco_4x4_50",
                                                  "aruco_5x5_250", "aruco_6x6_250"};

void DrawPairs(Desk& desk) {
  const tools::Registering& registering = desk.state().things.registering;
  if (registering.thing_id().empty()) return;
  std::optional<std::size_t> dropped;
  for (std::size_t i = 0; i < registering.pairs().size(); ++i) {
    const std::string drop = absl::StrCat("Drop point ", i + 1);
    if (ImGui::SmallButton(absl::StrCat("x###", drop).c_str())) dropped = i;
    NoteButton(desk, drop);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", drop.c_str());
    ImGui::SameLine();
    Wrapped(Colours().text, absl::StrCat(i + 1, ": ", registering.PairWords(i)));
  }
  Wrapped(registering.why.empty() ? Colours().text : Colours().warn, registering.Total());
  if (registering.result && ThingButton(desk, "Accept", -1)) desk.thing_work().Accept();
  if (dropped) desk.thing_work().DropPair(*dropped);
}

}  // namespace

void NoteButton(Desk& desk, const std::string& words) {
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  desk.state().things.buttons[words] = {low.x, low.y, high.x - low.x, high.y - low.y};
}

bool ThingButton(Desk& desk, const char* words, float width) {
  const bool pressed = ImGui::Button(words, {width, 0});
  NoteButton(desk, words);
  return pressed;
}

void DrawThingWork(const PanelContext& context) {
  Desk& desk = context.desk;
  if (desk.thing_work().has_way() && ThingButton(desk, "Done", -1)) {
    desk.thing_work().Finish(desk.state().main == Pane::kMap ? "map" : "video");
  }
  DrawPairs(desk);
}

void DrawMarkerFixing(const PanelContext& context) {
  Desk& desk = context.desk;
  ThingDesk& things = desk.state().things;
  const bool open = ImGui::CollapsingHeader("Moves with a marker");
  NoteButton(desk, "Moves with a marker");
  if (!open) return;
  session::Marker& marker = things.marker;
  ImGui::SetNextItemWidth(-1);
  if (ImGui::BeginCombo("##family", marker.family.c_str())) {
    NoteAbove(desk);
    for (const char* family : kFamilies) {
      if (ImGui::Selectable(family, marker.family == family)) marker.family = family;
    }
    ImGui::EndCombo();
  }
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("family of the marker");
  const float gap = 4 * context.scale;
  const float width = (ImGui::GetContentRegionAvail().x - gap) / 2;
  int id = static_cast<int>(marker.id);
  ImGui::SetNextItemWidth(width);
  if (ImGui::InputInt("##id", &id, 0)) marker.id = static_cast<std::uint32_t>(std::max(id, 0));
  NoteButton(desk, "id");
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("number of the marker");
  ImGui::SameLine(0, gap);
  ImGui::SetNextItemWidth(width);
  ImGui::InputDouble("##side", &marker.side_m, 0, 0, "%.3f m");
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("side of its black border [m]");
  const SceneObject* thing = desk.session().scene.scene().Find(things.selected_id);
  const bool fixed = thing != nullptr && thing->parent == SceneParent::kMarker;
  if (fixed) {
    const bool seen =
        session::FindMarker(desk.markers(), thing->marker_family, thing->marker_id) != nullptr;
    Wrapped(Colours().dim, absl::StrCat(thing->marker_family, " ", thing->marker_id,
                                        seen ? ", seen" : ", not seen yet"));
  } else {
    Wrapped(Colours().dim, "It stands by itself.");
  }
  if (ThingButton(desk, "Fix", width)) desk.thing_work().FixToMarker(desk.markers());
  if (!fixed) return;
  ImGui::SameLine(0, gap);
  if (ThingButton(desk, "Let go", width)) desk.thing_work().LetGo(desk.markers());
}

}  // namespace saccade::view
