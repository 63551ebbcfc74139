// The list of annotations.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "client/tools/words.hpp"
#include "client/view/panels.hpp"
#include "client/view/typesetter.hpp"
#include "shared/marks/shape_lines.hpp"

namespace saccade::view {
namespace {

// None of the features' four colours, nor the accent.
constexpr std::array<std::pair<std::uint32_t, const char*>, 5> kColors = {
    {{0xffffffff, "white"},
     {0xff9a3dff, "orange"},
     {0xff8ad8ff, "pink"},
     {0xd9b38cff, "tan"},
     {0x9fe7e7ff, "pale cyan"}}};

void DrawPalette(const PanelContext& context) {
  const float size = ImGui::GetFrameHeight();
  for (const auto& [rgba, name] : kColors) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (ImGui::InvisibleButton(name, {size, size})) context.desk.Paint(rgba);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s, for new marks and those selected", name);
    const ImVec2 middle{at.x + 0.5f * size, at.y + 0.5f * size};
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddCircleFilled(middle, 0.32f * size, ColorOf(rgba));
    list->AddCircle(middle, 0.32f * size, Colours().dim);  // white is to be seen on light too
    if (context.desk.state().color_rgba == rgba) {
      list->AddCircle(middle, 0.46f * size, Colours().accent, 0, 2 * context.scale);
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
                    (control.action == tools::Action::kHideMarks && desk.state().hides());
    if (ControlButton(control, on, width, context.fonts)) desk.Run(control.action, context.now_ns);
    if (control.action != tools::Action::kSnapshot) ImGui::SameLine(0, 4 * context.scale);
  }
  Wrapped(Colours().warn, desk.state().Refusal("Snapshot"));
  ImGui::SetNextItemWidth(-1);
  if (std::exchange(desk.state().find, false)) ImGui::SetKeyboardFocusHere();
  Field("##find", desk.state().filter.text, "Find marks (/)");
}

/// The lines of a check list, to be ticked off; who did stands beside.
void DrawItems(const PanelContext& context, const Annotation& annotation) {
  if (!annotation.check_items) return;
  ImGui::Indent(20 * context.scale);
  for (std::size_t i = 0; i < annotation.check_items->size(); ++i) {
    const CheckItem& item = (*annotation.check_items)[i];
    bool done = item.done;
    ImGui::PushID(static_cast<int>(i));
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(2 * context.scale, 2 * context.scale));
    if (ImGui::Checkbox("##done", &done)) {
      context.desk.Tick(annotation.id, static_cast<std::uint32_t>(i), done);
    }
    ImGui::PopStyleVar();
    ImGui::SameLine(0, 6 * context.scale);
    Wrapped(item.done ? Colours().dim : Colours().text,
            item.done_by.empty() ? item.text : absl::StrCat(item.text, " · ", item.done_by));
    ImGui::PopID();
  }
  ImGui::Unindent(20 * context.scale);
}

void DrawRow(const PanelContext& context, const Annotation& annotation, const tools::Scale& scale) {
  Desk& desk = context.desk;
  const std::string& id = annotation.id;
  const bool selected = desk.state().selection.Has(id);
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
  if (ImGui::InvisibleButton("pick", size)) {
    desk.Select(id, ImGui::GetIO().KeyShift || ImGui::GetIO().KeyCtrl);
  }
  ImGui::SetItemAllowOverlap();
  if (ImGui::IsItemHovered()) {
    desk.state().pointed_id = id;
    if (ImGui::IsMouseDoubleClicked(0)) desk.EditText(id, at.x - 320 * context.scale, at.y);
  }
  ImDrawList* list = ImGui::GetWindowDrawList();
  const bool hovered = ImGui::IsItemHovered();
  if (selected || hovered) {
    list->AddRectFilled(at, {at.x + size.x, at.y + size.y}, Colours().raised, 4 * context.scale);
  }
  if (selected) {
    list->AddRectFilled(at, {at.x + 3 * context.scale, at.y + size.y}, Colours().accent);
  }
  const ImVec2 dot{at.x + 11 * context.scale, at.y + pad + 0.5f * line};
  list->AddCircleFilled(dot, 4 * context.scale, ColorOf(annotation.color_rgba));
  list->AddCircle(dot, 4 * context.scale, Colours().dim);
  std::string title = LabelWords(annotation, scale.metric);
  title = title.substr(0, title.find('\n'));
  if (annotation.text.empty() && title.empty()) title = tools::ShapeWord(annotation.shape);
  if (annotation.locked) title += " (locked)";
  if (desk.state().hidden.contains(id)) title += " (hidden)";
  title = Types().Set(title);
  const std::string by = annotation.anchor.state == AnchorState::kProvisional
                             ? "provisional"
                             : Types().Set(annotation.author);
  list->PushClipRect(at, {at.x + width - buttons, at.y + size.y}, true);
  list->AddText({text_x, at.y + pad}, Colours().text, title.c_str());
  const float title_width = ImGui::CalcTextSize(title.c_str()).x;
  list->AddText({text_x + title_width + 8 * context.scale, at.y + pad}, Colours().dim, by.c_str());
  list->PopClipRect();
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(),
                {text_x, at.y + pad + line + 2 * context.scale},
                words.warn ? Colours().warn : Colours().dim, words.text.c_str(), nullptr, wrap);
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
  DrawItems(context, annotation);
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
  BeginPanel("annotations", rect, Colours().panel);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Annotations");
  ImGui::PopFont();
  ImGui::SameLine();
  const std::string some =
      desk.state().filter.active() ? absl::StrCat(listed.size(), " of ") : std::string();
  const std::size_t selected = desk.state().selection.ids().size();
  const std::string chosen = selected > 1 ? absl::StrCat(", ", selected, " selected") : "";
  ImGui::TextDisabled("%s%zu%s", some.c_str(), all.size(), chosen.c_str());
  DrawPalette(context);
  DrawBar(context);
  ImGui::BeginChild("rows");
  if (listed.empty()) {
    Wrapped(Colours().dim,
            all.empty() ? "None yet. Choose a cube (C), note (N), arrow (A) or ink (I), then "
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

}  // namespace saccade::view
