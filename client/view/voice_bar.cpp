// Joins the voices, mutes, push to talk, and who is there and who speaks.
#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <algorithm>

#include "client/view/panels.hpp"

namespace saccade::view {
namespace {

bool Toggle(const char* label, const char* hint, bool on) {
  if (on) {
    ImGui::PushStyleColor(ImGuiCol_Button, Colours().accent);
    ImGui::PushStyleColor(ImGuiCol_Text, Colours().on_accent);
  }
  const bool pressed = ImGui::Button(label);
  if (on) ImGui::PopStyleColor(2);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", hint);
  return pressed;
}

bool Listens(const std::vector<std::string>& ids, const std::string& id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

/// On the same line where there is room.
void Next(const char* label) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float needed = ImGui::CalcTextSize(label).x + 2 * style.FramePadding.x;
  ImGui::SameLine();
  if (ImGui::GetContentRegionAvail().x < needed) ImGui::NewLine();
}

}  // namespace

std::string SpeakerWords(const Desk& desk) {
  std::string words;
  for (const net::Participant& each : desk.session().participants) {
    if (!desk.voice().Speaks(each.participant_id)) continue;
    const bool own = each.participant_id == desk.session().joined.participant_id;
    absl::StrAppend(&words, words.empty() ? "" : ", ", own ? "you" : each.display_name);
  }
  return words.empty() ? words : absl::StrCat("● ", words, words == "you" ? " speak" : " speaks");
}

void DrawVoice(const PanelContext& context) {
  Desk& desk = context.desk;
  const talk::VoiceRoom& room = desk.voice();
  const bool off = room.state() == talk::VoiceRoom::State::kOff;
  if (Toggle(off ? "Join voice" : "Leave voice",
             off ? "Hear the others, and be heard (8)" : "Leave the voices (8)", false)) {
    desk.Run(tools::Action::kVoice, context.now_ns);
  }
  if (room.has_microphone()) {
    Next("Unmute");
    if (Toggle(room.muted() ? "Unmute" : "Mute",
               room.muted() ? "Be heard again (7)" : "Not heard until unmuted (7)", room.muted())) {
      desk.Run(tools::Action::kMute, context.now_ns);
    }
    Next("Push to talk");
    if (Toggle("Push to talk", "Heard only while Space is held", room.push_to_talk())) {
      desk.TogglePushToTalk();
    }
  }
  std::string there;
  const session::State& told = desk.session();
  for (const net::Participant& each : told.participants) {
    if (!Listens(told.listeners, each.participant_id)) continue;
    const bool own = each.participant_id == desk.session().joined.participant_id;
    absl::StrAppend(&there, there.empty() ? "" : ", ", each.display_name, own ? " (you)" : "");
  }
  Wrapped(Colours().text, room.Words());
  if (!there.empty()) Wrapped(Colours().dim, absl::StrCat("Who hears: ", there));
  Wrapped(Colours().accent, SpeakerWords(desk));
  Wrapped(Colours().warn, room.problem());
}

}  // namespace saccade::view
