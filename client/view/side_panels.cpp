// The head, and what the keys do.
#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <algorithm>

#include "client/tools/words.hpp"
#include "client/view/panels.hpp"

namespace saccade::view {
namespace {

/// Over a picture these have their colour; here words, that have to be read, have the panel's.
void Sign(ImU32 color, const char* sign, const char* words) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float size = ImGui::GetFontSize();
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled({at.x - 0.15f * size, at.y}, {at.x + 1.15f * size, at.y + 1.2f * size},
                      kGround, 0.2f * size);
  list->AddText({at.x + 0.1f * size, at.y}, color, sign);
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 1.6f * size);
  Wrapped(Colours().text, words);
}

}  // namespace

void DrawGaze(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  const session::State& state = desk.session();
  const tools::StatusWords words = tools::GazeWords(state);
  BeginPanel("gaze", rect, Colours().panel, true);
  ImGui::GetWindowDrawList()->AddLine({rect.x, rect.y}, {rect.right(), rect.y}, Colours().line);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Gaze");
  ImGui::PopFont();
  Wrapped(words.warn ? Colours().warn : Colours().text, absl::StrCat(words.mark, " ", words.text));
  if (state.gaze && state.gaze->joints_rad && state.link.live()) {
    Wrapped(Colours().dim, tools::DirectionWords(*state.gaze->joints_rad));
  }
  Wrapped(Colours().warn, words.advice);
  Wrapped(Colours().dim, tools::SteerWords(state, desk.pilot()));
  const float gap = 4 * context.scale;
  const float width = (ImGui::GetContentRegionAvail().x - gap) / 2;
  bool left = true;
  for (tools::Control control : tools::Controls()) {
    if (control.group != tools::Group::kHead) continue;
    using Kind = session::GazePilot::Kind;
    const bool lease = control.action == tools::Action::kLease;
    if (lease && desk.pilot().kind() == Kind::kHeld) control.label = "Release";
    if (lease && desk.pilot().kind() == Kind::kWaiting) control.label = "Leave queue";
    const bool on = (control.action == tools::Action::kFast && desk.state().fast) ||
                    (lease && desk.pilot().kind() != Kind::kNone);
    if (ControlButton(control, on, width, context.fonts)) desk.Run(control.action, context.now_ns);
    if (left) ImGui::SameLine(0, gap);
    left = !left;
  }
  const std::string refusal = desk.state().Refusal("head");
  Wrapped(Colours().warn, refusal.empty() ? desk.pilot().lost() : refusal);
  EndPanel();
}

void DrawHelp(const PanelContext& context, bool& open) {
  if (!open) return;
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos({0.5f * io.DisplaySize.x, 0.5f * io.DisplaySize.y}, ImGuiCond_Always,
                          {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(720 * context.scale, 0.92f * io.DisplaySize.x),
                            std::min(640 * context.scale, 0.92f * io.DisplaySize.y)});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, Colours().raised);
  ImGui::SetNextWindowFocus();
  ImGui::Begin("Keys", nullptr,
               (ImGuiWindowFlags_NoDecoration & ~ImGuiWindowFlags_NoScrollbar) |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Keys");
  ImGui::PopFont();
  for (const tools::Control& control : tools::Controls()) {
    ImGui::TextUnformatted(control.shown);
    ImGui::SameLine(64 * context.scale);
    ImGui::TextUnformatted(control.label);
    ImGui::SameLine(184 * context.scale);
    Wrapped(Colours().dim, control.hint);
  }
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Features");
  ImGui::PopFont();
  Sign(ColorOf(FeatureState::kMeasured), "●", "measured in this picture");
  Sign(ColorOf(FeatureState::kFailed), "×", "searched for, not found");
  Sign(ColorOf(FeatureState::kNotAttempted), "○",
       "not searched for in this picture: drawn where the map has it");
  Sign(kTarget, "◎", "what the camera is to look at; its ring is solid once it is held");
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Map");
  ImGui::PopFont();
  Wrapped(Colours().dim,
          "Drag to orbit, right-drag or Shift-drag to pan, wheel to zoom. Arrow keys orbit, with "
          "Shift they pan; plus and minus zoom, Enter places at the middle. Edges of the list and "
          "of the inset can be dragged; a double click on a row changes its text.");
  if (ImGui::Button("Close")) open = false;
  NoteAbove(context.desk);
  ImGui::End();
  ImGui::PopStyleColor();
}

}  // namespace saccade::view
