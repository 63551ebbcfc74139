// What people say: lines that may carry a mark ("look here").
#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <utility>

#include "client/tools/marks.hpp"
#include "client/tools/words.hpp"
#include "client/view/panels.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

void DrawMessage(const PanelContext& context, const net::ChatMessage& message) {
  Desk& desk = context.desk;
  const bool mine = message.participant_id == desk.session().joined.participant_id;
  ImGui::PushID(static_cast<int>(message.number));
  ImGui::PushStyleColor(ImGuiCol_Text, Colours().dim);
  ImGui::TextUnformatted(absl::StrCat(mine ? "you" : Types().Set(message.display_name), "  ",
                                      tools::ClockWords(message.sent_unix_ns))
                             .c_str());
  ImGui::PopStyleColor();
  Wrapped(Colours().text, message.text);
  if (!message.annotation_id.empty()) {
    const Annotation* mark = desk.session().annotations.Find(message.annotation_id);
    if (mark == nullptr) {
      Wrapped(Colours().dim, "the mark is gone");
    } else if (ImGui::Button(
                   absl::StrCat(Types().Set(absl::StrCat("look here: ", tools::TitleOf(*mark))),
                                "###look")
                       .c_str())) {
      desk.Show(mark->id);
    }
  }
  ImGui::PopID();
}

void DrawField(const PanelContext& context) {
  Desk& desk = context.desk;
  TalkField& talk = desk.state().talk;
  const Annotation* mark = desk.session().annotations.Find(desk.state().selection.last());
  if (mark == nullptr) talk.carries = false;
  if (mark != nullptr) {
    const std::string chip =
        absl::StrCat(talk.carries ? "✓ " : "+ ", Types().Set(tools::TitleOf(*mark)), "###carries");
    if (ImGui::Button(chip.c_str())) talk.carries = !talk.carries;
    if (ImGui::IsItemHovered()) {
      ImGui::SetTooltip("Look here: the selected mark goes with the message");
    }
  }
  const float send = ImGui::CalcTextSize("Send").x + 4 * ImGui::GetStyle().FramePadding.x;
  ImGui::SetNextItemWidth(-send);
  if (std::exchange(talk.wanted, false)) ImGui::SetKeyboardFocusHere();
  ImGui::PushID(talk.field);
  bool entered = Field("##say", talk.text, "Message (9)", ImGuiInputTextFlags_EnterReturnsTrue);
  talk.writing = ImGui::IsItemActive();
  ImGui::PopID();
  entered = std::exchange(talk.finish, false) || entered;
  ImGui::SameLine();
  if (ImGui::Button("Send") || entered) {
    desk.Say();
    talk.wanted = entered;  // for the next one
  }
  AsRead(talk.text);
  Wrapped(Colours().warn, talk.problem);
}

}  // namespace

void DrawTalk(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  TalkField& talk = desk.state().talk;
  const session::State& state = desk.session();
  BeginPanel("talk", rect, Colours().panel);
  ImGui::GetWindowDrawList()->AddLine({rect.x, rect.y}, {rect.right(), rect.y}, Colours().line);
  const std::size_t unread = state.chat.Unread(state.joined.participant_id);
  std::string head = absl::StrCat(talk.open ? "▾ " : "▸ ", "Talk");
  if (unread > 0) absl::StrAppend(&head, "  ", unread, " new");
  if (const std::string speaks = SpeakerWords(desk); !talk.open && !speaks.empty()) {
    absl::StrAppend(&head, "  ", speaks);
  } else if (!talk.open && !state.chat.messages().empty()) {
    const net::ChatMessage& last = state.chat.messages().back();
    absl::StrAppend(&head, "  ", last.display_name, ": ", last.text);
  }
  ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, ImVec2(0, 0.5f));
  ImGui::PushStyleColor(ImGuiCol_Text, unread > 0 ? Colours().accent : Colours().text);
  if (ImGui::Button(absl::StrCat(Types().Set(head), "###talk").c_str(), {-1, 0}))
    talk.open = !talk.open;
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  if (!talk.open) talk.writing = false;
  if (talk.open) {
    desk.session().chat.MarkRead();
    DrawVoice(context);
    const float field =
        (desk.state().selection.empty() ? 1.0f : 2.0f) * ImGui::GetFrameHeightWithSpacing() +
        (talk.problem.empty() ? 0.0f : 2 * ImGui::GetTextLineHeightWithSpacing()) +
        (Typesetter::IsSimple(talk.text) ? 0.0f : 3 * ImGui::GetTextLineHeightWithSpacing());
    ImGui::BeginChild("messages", {0, -field});
    const bool at_end = ImGui::GetScrollY() >= ImGui::GetScrollMaxY() - 40 * context.scale;
    for (const net::ChatMessage& message : state.chat.messages()) DrawMessage(context, message);
    if (state.chat.messages().empty()) Wrapped(Colours().dim, "Nothing was said yet.");
    if (at_end) ImGui::SetScrollHereY(1);
    ImGui::EndChild();
    DrawField(context);
  }
  EndPanel();
}

}  // namespace saccade::view
