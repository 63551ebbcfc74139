// The fields in which something is written before it is placed.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "client/tools/written.hpp"
#include "client/view/panels.hpp"

namespace saccade::view {
namespace {

constexpr ImGuiWindowFlags kFixed =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings;

}  // namespace

void DrawEditor(const PanelContext& context, const Rect& within) {
  Desk& desk = context.desk;
  if (!desk.state().editor) return;
  TextEditor& editor = *desk.state().editor;
  const float width = 300 * context.scale, height = 96 * context.scale;
  ImGui::SetNextWindowPos(
      {std::clamp(editor.x, within.x, std::max(within.x, within.right() - width)),
       std::clamp(editor.y, within.y, std::max(within.y, within.bottom() - height))});
  ImGui::SetNextWindowSize({width, 0});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, Colours().raised);
  ImGui::Begin("editor", nullptr, kFixed);
  ImGui::TextUnformatted(editor.id.empty() ? "New note" : "Text of the mark");
  ImGui::SetNextItemWidth(-1);
  if (!editor.opened) ImGui::SetKeyboardFocusHere();
  editor.opened = true;
  const bool entered = Field("##text", editor.text, "", ImGuiInputTextFlags_EnterReturnsTrue);
  AsRead(editor.text);
  const bool fits = editor.text.size() <= tools::kMaxTextBytes;
  const std::size_t room =
      fits ? tools::kMaxTextBytes - editor.text.size() : editor.text.size() - tools::kMaxTextBytes;
  ImGui::PushStyleColor(ImGuiCol_Text, fits ? Colours().dim : Colours().warn);
  ImGui::AlignTextToFramePadding();
  ImGui::Text(fits ? "%zu bytes left" : "%zu bytes too long: shorten it", room);
  ImGui::PopStyleColor();
  ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Button, Colours().line);
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

void DrawDialog(const PanelContext& context, const Rect& within) {
  Desk& desk = context.desk;
  if (!desk.state().dialog) return;
  PlacingDialog& dialog = *desk.state().dialog;
  const bool list = dialog.shape == AnnotationShape::kCheckList;
  ImGui::SetNextWindowPos({within.x + 0.5f * within.width, within.y + 0.5f * within.height},
                          ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(420 * context.scale, 0.95f * within.width), 0});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, Colours().raised);
  ImGui::Begin("dialog", nullptr, kFixed);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted(list ? "Check list" : "Picture");
  ImGui::PopFont();
  ImGui::TextUnformatted(list ? "Title"
                              : "PNG, JPEG or PDF file, or drop one into the map or the video");
  ImGui::SetNextItemWidth(-1);
  if (!dialog.opened) ImGui::SetKeyboardFocusHere();
  dialog.opened = true;
  bool keep = std::exchange(dialog.finish, false);
  if (list) {
    Field("##title", dialog.title);
    ImGui::TextUnformatted("What is to be done, a line each");
    keep = LinesField("##lines", dialog.lines, {-1, 7 * ImGui::GetFontSize()},
                      ImGuiInputTextFlags_EnterReturnsTrue) ||
           keep;  // with Ctrl
    AsRead(dialog.lines);
  } else {
    keep = Field("##file", dialog.file, "", ImGuiInputTextFlags_EnterReturnsTrue) || keep;
    if (absl::EndsWithIgnoreCase(dialog.file, ".pdf")) {
      ImGui::TextUnformatted("Page");
      ImGui::SetNextItemWidth(8 * ImGui::GetFontSize());
      ImGui::InputInt("##page", &dialog.page);
      dialog.page = std::max(dialog.page, 1);
    }
    ImGui::TextUnformatted("Words under it");
    ImGui::SetNextItemWidth(-1);
    keep = Field("##title", dialog.title, "", ImGuiInputTextFlags_EnterReturnsTrue) || keep;
  }
  AsRead(dialog.title);
  if (dialog.loading) Wrapped(Colours().dim, "Reading the file.");
  Wrapped(Colours().warn, dialog.problem);
  ImGui::PushStyleColor(ImGuiCol_Button, Colours().line);
  keep = ImGui::Button(list ? "Place it (Ctrl Enter)" : "Place it (Enter)") || keep;
  ImGui::SameLine();
  const bool cancelled = ImGui::Button("Cancel (Esc)");
  ImGui::PopStyleColor();
  NoteAbove(desk);
  ImGui::End();
  ImGui::PopStyleColor();
  if (cancelled || keep) desk.FinishDialog(!cancelled);
}

}  // namespace saccade::view
