// The list of annotations, the field for text, and the head.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>

#include "client/tools/words.hpp"
#include "client/view/panels.hpp"
#include "shared/marks/shape_lines.hpp"

namespace saccade::view {
namespace {

constexpr std::size_t kMaxTextBytes = 500;  // annotation.proto
// None of the features' four colours, nor the accent.
constexpr std::array<std::pair<std::uint32_t, const char*>, 5> kColors = {
    {{0xffffffff, "white"},
     {0xff9a3dff, "orange"},
     {0xff8ad8ff, "pink"},
     {0xd9b38cff, "tan"},
     {0x9fe7e7ff, "pale cyan"}}};

void Wrapped(ImU32 color, const std::string& text) {
  if (text.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::PushTextWrapPos();
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

void DrawPalette(const PanelContext& context) {
  const float size = ImGui::GetFrameHeight();
  for (const auto& [rgba, name] : kColors) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (ImGui::InvisibleButton(name, {size, size})) context.desk.Paint(rgba, context.now_ns);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s, for new marks and the selected one", name);
    const ImVec2 middle{at.x + 0.5f * size, at.y + 0.5f * size};
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddCircleFilled(middle, 0.32f * size, ColorOf(rgba));
    if (context.desk.state().color_rgba == rgba) {
      list->AddCircle(middle, 0.46f * size, kAccent, 0, 2 * context.scale);
    }
    ImGui::SameLine(0, 4 * context.scale);
  }
  ImGui::NewLine();
}

void DrawBar(const PanelContext& context) {
  Desk& desk = context.desk;
  const float width = (ImGui::GetContentRegionAvail().x - 2 * 4 * context.scale) / 3;
  for (const tools::Control& control : tools::Controls()) {
    if (control.group != tools::Group::kMarks) continue;
    const bool on = (control.action == tools::Action::kOnlyMine && desk.state().filter.mine) ||
                    (control.action == tools::Action::kHideMarks && desk.state().hide_marks);
    if (ControlButton(control, on, width, context.fonts)) desk.Run(control.action, context.now_ns);
    if (control.action != tools::Action::kSnapshot) ImGui::SameLine(0, 4 * context.scale);
  }
  Wrapped(kWarn, desk.state().Refusal("Snapshot"));
  ImGui::SetNextItemWidth(-1);
  if (std::exchange(desk.state().find, false)) ImGui::SetKeyboardFocusHere();
  ImGui::InputTextWithHint("##find", "Find marks (/)", &desk.state().filter.text);
}

void DrawRow(const PanelContext& context, const Annotation& annotation, const tools::Scale& scale) {
  Desk& desk = context.desk;
  const std::string& id = annotation.id;
  const bool selected = desk.state().selected_id == id;
  tools::AnchorWords words = tools::WordsOf(annotation, scale);
  const std::string refusal = desk.state().Refusal(absl::StrCat("annotation ", id));
  if (!refusal.empty()) words = {refusal, true};
  if (const auto age = desk.session().Age(context.now_ns)) {
    absl::StrAppend(&words.text, " · as of ", tools::SpanWords(*age), " ago");
  }
  ImGui::PushID(id.c_str());
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float line = ImGui::GetTextLineHeight();
  const float pad = 6 * context.scale, width = ImGui::GetContentRegionAvail().x;
  const float text_x = at.x + 20 * context.scale;
  const float buttons = 2 * ImGui::GetFrameHeight() + 3 * pad;
  const float wrap = std::max(width - 20 * context.scale - pad, 60.0f);
  const float state_height = ImGui::CalcTextSize(words.text.c_str(), nullptr, false, wrap).y;
  const ImVec2 size{width, line + state_height + 2 * pad + 2 * context.scale};
  ImGui::SetItemAllowOverlap();
  if (ImGui::InvisibleButton("pick", size)) desk.Select(id);
  ImGui::SetItemAllowOverlap();
  if (ImGui::IsItemHovered()) {
    desk.state().pointed_id = id;
    if (ImGui::IsMouseDoubleClicked(0)) desk.EditText(id, at.x - 320 * context.scale, at.y);
  }
  ImDrawList* list = ImGui::GetWindowDrawList();
  const bool hovered = ImGui::IsItemHovered();
  if (selected || hovered) {
    list->AddRectFilled(at, {at.x + size.x, at.y + size.y}, kRaised, 4 * context.scale);
  }
  if (selected) {
    list->AddRectFilled(at, {at.x + 3 * context.scale, at.y + size.y}, kAccent);
  }
  list->AddCircleFilled({at.x + 11 * context.scale, at.y + pad + 0.5f * line}, 4 * context.scale,
                        ColorOf(annotation.color_rgba));
  std::string title = LabelWords(annotation, scale.metric);
  title = title.substr(0, title.find('\n'));
  if (annotation.text.empty() && title.empty()) title = tools::ShapeWord(annotation.shape);
  if (annotation.locked) title += " (locked)";
  const std::string by =
      annotation.anchor.state == AnchorState::kProvisional ? "provisional" : annotation.author;
  list->PushClipRect(at, {at.x + width - buttons, at.y + size.y}, true);
  list->AddText({text_x, at.y + pad}, kText, title.c_str());
  const float title_width = ImGui::CalcTextSize(title.c_str()).x;
  list->AddText({text_x + title_width + 8 * context.scale, at.y + pad}, kDim, by.c_str());
  list->PopClipRect();
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(),
                {text_x, at.y + pad + line + 2 * context.scale}, words.warn ? kWarn : kDim,
                words.text.c_str(), nullptr, wrap);
  if (selected || hovered) {
    const ImVec2 after = ImGui::GetCursorScreenPos();
    ImGui::SetCursorScreenPos({at.x + width - buttons + pad, at.y + 0.5f * pad});
    if (ImGui::Button("◎")) {
      desk.LookAtMark(id, absl::StrCat("annotation ", id), context.now_ns);
    }
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("turn the camera to it");
    ImGui::SameLine(0, pad);
    if (ImGui::Button("×")) desk.Remove(id, context.now_ns);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("delete (Del)");
    ImGui::SetCursorScreenPos(after);
  }
  ImGui::PopID();
}

}  // namespace

void DrawAnnotations(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  const std::vector<Annotation> all = desk.session().annotations.List();
  std::vector<Annotation> listed = all;
  std::erase_if(listed, [&desk](const Annotation& each) {
    return !tools::Passes(each, desk.state().filter, desk.state().my_name);
  });
  BeginPanel("annotations", rect, kPanel);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Annotations");
  ImGui::PopFont();
  ImGui::SameLine();
  const std::string some =
      desk.state().filter.active() ? absl::StrCat(listed.size(), " of ") : std::string();
  ImGui::TextDisabled("%s%zu", some.c_str(), all.size());
  DrawPalette(context);
  DrawBar(context);
  ImGui::BeginChild("rows");
  if (listed.empty()) {
    Wrapped(kDim, all.empty() ? "None yet. Choose a cube (C), note (N), arrow (A) or ink (I), then "
                                "click in the map or the video."
                              : "None of the marks is like that.");
  }
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(0, 2 * context.scale));
  const tools::Scale scale = tools::ScaleOf(desk.session());
  if (ImGui::IsWindowHovered(ImGuiHoveredFlags_ChildWindows)) desk.state().pointed_id.clear();
  for (const Annotation& annotation : listed) DrawRow(context, annotation, scale);
  ImGui::PopStyleVar();
  ImGui::EndChild();
  EndPanel();
}

void DrawEditor(const PanelContext& context, const Rect& within) {
  Desk& desk = context.desk;
  if (!desk.state().editor) return;
  TextEditor& editor = *desk.state().editor;
  const float width = 300 * context.scale, height = 96 * context.scale;
  ImGui::SetNextWindowPos(
      {std::clamp(editor.x, within.x, std::max(within.x, within.right() - width)),
       std::clamp(editor.y, within.y, std::max(within.y, within.bottom() - height))});
  ImGui::SetNextWindowSize({width, 0});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, kRaised);
  ImGui::Begin(
      "editor", nullptr,
      ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  ImGui::TextUnformatted(editor.id.empty() ? "New note" : "Text of the mark");
  ImGui::SetNextItemWidth(-1);
  if (!editor.opened) ImGui::SetKeyboardFocusHere();
  editor.opened = true;
  const bool entered =
      ImGui::InputText("##text", &editor.text, ImGuiInputTextFlags_EnterReturnsTrue);
  const bool fits = editor.text.size() <= kMaxTextBytes;
  const std::size_t room =
      fits ? kMaxTextBytes - editor.text.size() : editor.text.size() - kMaxTextBytes;
  ImGui::PushStyleColor(ImGuiCol_Text, fits ? kDim : kWarn);
  ImGui::AlignTextToFramePadding();
  ImGui::Text(fits ? "%zu bytes left" : "%zu bytes too long: shorten it", room);
  ImGui::PopStyleColor();
  ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Button, kLine);
  const bool placed = ImGui::Button(editor.id.empty() ? "Place" : "Save");
  ImGui::SameLine();
  const bool cancelled = ImGui::Button("Cancel");
  ImGui::PopStyleColor();
  NoteAbove(desk);
  ImGui::End();
  ImGui::PopStyleColor();
  if (cancelled) {
    desk.FinishEditor(false, context.now_ns);
  } else if ((entered || placed || editor.finish) && fits) {
    desk.FinishEditor(true, context.now_ns);
  } else {
    editor.finish = false;
  }
}

void DrawGaze(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  const session::State& state = desk.session();
  const tools::StatusWords words = tools::GazeWords(state);
  BeginPanel("gaze", rect, kPanel, true);
  ImGui::GetWindowDrawList()->AddLine({rect.x, rect.y}, {rect.right(), rect.y}, kLine);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Gaze");
  ImGui::PopFont();
  Wrapped(words.warn ? kWarn : kText, absl::StrCat(words.mark, " ", words.text));
  if (state.gaze && state.gaze->joints_rad && state.link.live()) {
    Wrapped(kDim, tools::DirectionWords(*state.gaze->joints_rad));
  }
  Wrapped(kWarn, words.advice);
  Wrapped(kDim, tools::SteerWords(state, desk.pilot()));
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
  Wrapped(kWarn, refusal.empty() ? desk.pilot().lost() : refusal);
  EndPanel();
}

void DrawHelp(const PanelContext& context, bool& open) {
  if (!open) return;
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos({0.5f * io.DisplaySize.x, 0.5f * io.DisplaySize.y}, ImGuiCond_Always,
                          {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(720 * context.scale, 0.92f * io.DisplaySize.x),
                            std::min(640 * context.scale, 0.92f * io.DisplaySize.y)});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, kRaised);
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
    Wrapped(kDim, control.hint);
  }
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Features");
  ImGui::PopFont();
  Wrapped(ColorOf(FeatureState::kMeasured), "●  measured in this picture");
  Wrapped(ColorOf(FeatureState::kFailed), "×  searched for, not found");
  Wrapped(ColorOf(FeatureState::kNotAttempted),
          "○  not searched for in this picture: drawn where the map has it");
  Wrapped(kTarget, "◎  what the camera is to look at; its ring is solid once it is held");
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Map");
  ImGui::PopFont();
  Wrapped(kDim,
          "Drag to orbit, right-drag or Shift-drag to pan, wheel to zoom. Arrow keys orbit, with "
          "Shift they pan; plus and minus zoom, Enter places at the middle. Edges of the list and "
          "of the inset can be dragged; a double click on a row changes its text.");
  if (ImGui::Button("Close")) open = false;
  NoteAbove(context.desk);
  ImGui::End();
  ImGui::PopStyleColor();
}

}  // namespace saccade::view
