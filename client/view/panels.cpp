#include "client/view/panels.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>

#include "client/tools/words.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

void Colored(ImU32 color, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextUnformatted(Types().Set(text).c_str());
  ImGui::PopStyleColor();
}

/// As much of it as fits, the rest as a tooltip.
void Fitted(ImU32 color, const std::string& text, float width) {
  std::string shown = text;
  if (width < 2 * ImGui::GetFontSize()) return;
  const auto extent = [](const std::string& words) {
    return ImGui::CalcTextSize(Types().Set(words).c_str()).x;
  };
  while (!shown.empty() && extent(shown + "…") > width) {
    do {
      shown.pop_back();
    } while (!shown.empty() && (static_cast<unsigned char>(shown.back()) & 0xc0) == 0xc0);
  }
  Colored(color, shown == text || extent(text) <= width ? text : shown + "…");
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", Types().Set(text).c_str());
}

}  // namespace

bool BeginPanel(const char* name, const Rect& rect, ImU32 color, bool scrolls) {
  ImGui::SetNextWindowPos({rect.x, rect.y});
  ImGui::SetNextWindowSize({rect.width, rect.height});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, color);
  ImGuiWindowFlags flags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                           ImGuiWindowFlags_NoSavedSettings |
                           ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoNavFocus;
  if (scrolls) flags &= ~ImGuiWindowFlags_NoScrollbar;
  return ImGui::Begin(name, nullptr, flags);
}

void EndPanel() {
  ImGui::End();
  ImGui::PopStyleColor();
}

void Wrapped(ImU32 color, const std::string& text) {
  if (text.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::PushTextWrapPos();
  ImGui::TextUnformatted(Types().Set(text, ImGui::GetContentRegionAvail().x).c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

bool Field(const char* label, std::string& text, const char* hint, ImGuiInputTextFlags flags) {
  std::string field = Types().ToField(text);
  const bool entered = ImGui::InputTextWithHint(label, hint, &field, flags);
  text = Types().FromField(field);
  return entered;
}

bool LinesField(const char* label, std::string& text, const ImVec2& size,
                ImGuiInputTextFlags flags) {
  std::string field = Types().ToField(text);
  const bool entered = ImGui::InputTextMultiline(label, &field, size, flags);
  text = Types().FromField(field);
  return entered;
}

void AsRead(const std::string& text) {
  if (!Typesetter::IsSimple(text)) Wrapped(Colours().dim, absl::StrCat("Reads:\n", text));
}

void NoteAbove(Desk& desk) {
  const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  desk.state().above.push_back({at.x, at.y, size.x, size.y});
}

bool DrawHeader(const PanelContext& context, const Rect& rect) {
  const session::State& state = context.desk.session();
  const tools::StatusWords words = tools::StatusOf(state, context.now_ns);
  BeginPanel("header", rect, Colours().bar);
  const float line = 0.5f * (rect.height - ImGui::GetFontSize());
  ImGui::SetCursorPosY(line);
  ImGui::PushFont(context.fonts.bold);
  ImGui::TextUnformatted("Saccade");
  ImGui::PopFont();
  const double fps = context.desk.rate().Rate(context.now_ns);
  const auto total = context.desk.latency().Get(session::Stage::kTotal);
  const bool live = state.link.live() && fps > 0;
  const std::string rate = live ? absl::StrFormat("%3.0f fps", fps) : "  – fps";
  const std::string late = live && total ? absl::StrFormat("%4.0f ms", total->p50) : "   – ms";
  const std::string here = state.link.live() ? tools::PresenceWords(state.participants) : "";
  const float gap = 16 * context.scale;
  const auto width = [](const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; };
  const float rate_width = width("000 fps"), late_width = width("0000 ms");
  const float button = ImGui::GetFrameHeight() + 6 * context.scale;
  const float right = rect.width - button - 10 * context.scale;
  const float rest = right - rate_width - late_width - width(here) - 3 * gap;
  ImGui::SameLine(0, gap);
  Fitted(Colours().dim, context.desk.title(),
         std::min(width(context.desk.title()) + 1, 0.22f * rect.width));
  ImGui::SameLine(0, gap);
  Colored(words.warn ? Colours().warn : Colours().text, words.mark);
  ImGui::SameLine(0, 6 * context.scale);
  ImGui::PushFont(context.fonts.bold);
  Colored(words.warn ? Colours().warn : Colours().text, words.text);
  ImGui::PopFont();
  ImGui::SameLine(0, gap);
  Fitted(words.warn ? Colours().warn : Colours().dim, words.advice,
         rest - ImGui::GetCursorPosX() - gap);
  ImGui::SetCursorPos({rest + gap, line});
  Colored(Colours().text, rate);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("pictures shown a second");
  ImGui::SetCursorPos({rest + gap + rate_width + gap, line});
  Colored(Colours().text, late);
  if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip(
        "from the middle of the exposure to this screen, median of the last 90 pictures");
  }
  ImGui::SetCursorPos({right - width(here) - 0.5f * gap, line});
  Colored(Colours().dim, here);
  if (ImGui::IsItemHovered() && !state.participants.empty()) {
    std::string names;
    for (const net::Participant& one : state.participants) {
      absl::StrAppend(&names, names.empty() ? "" : ", ", one.display_name);
    }
    ImGui::SetTooltip("%s", Types().Set(names).c_str());
  }
  ImGui::SetCursorPos({right, 0.5f * (rect.height - ImGui::GetFrameHeight())});
  const bool help = ImGui::Button("?", {button, 0});
  EndPanel();
  return help;
}

std::size_t DrawTabs(const std::vector<Desk*>& desks, std::size_t shown, const Rect& rect,
                     Timestamp now_ns) {
  BeginPanel("tabs", rect, Colours().bar);
  ImGui::SetCursorPosY(0.5f * (rect.height - ImGui::GetFrameHeight()));
  for (std::size_t i = 0; i < desks.size(); ++i) {
    const tools::StatusWords words = tools::StatusOf(desks[i]->session(), now_ns);
    const std::string text = absl::StrCat(words.mark, " ", Types().Set(desks[i]->title()), ": ",
                                          words.text, "###tab", i);
    const bool on = i == shown;
    ImGui::PushStyleColor(ImGuiCol_Button, on ? Colours().accent : Colours().raised);
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, on ? Colours().accent : Colours().line);
    ImGui::PushStyleColor(ImGuiCol_Text, on           ? Colours().on_accent
                                         : words.warn ? Colours().warn
                                                      : Colours().text);
    if (ImGui::Button(text.c_str())) shown = i;
    ImGui::PopStyleColor(3);
    ImGui::SameLine();
  }
  EndPanel();
  return shown;
}

bool ControlButton(const tools::Control& control, bool on, float width, const Fonts& fonts) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float height = ImGui::GetFrameHeight();
  ImGui::PushStyleColor(ImGuiCol_Button, on ? Colours().accent : Colours().raised);
  ImGui::PushStyleColor(ImGuiCol_ButtonHovered, on ? Colours().accent : Colours().line);
  ImGui::PushStyleColor(ImGuiCol_ButtonActive, on ? Colours().accent : Colours().line);
  const bool pressed = ImGui::Button(absl::StrCat("##", control.label).c_str(), {width, height});
  ImGui::PopStyleColor(3);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s (%s)", control.hint, control.shown);
  ImDrawList* list = ImGui::GetWindowDrawList();
  const float size = ImGui::GetFontSize(), y = at.y + 0.5f * (height - size);
  const float pad = 0.5f * size;
  const float key_width = fonts.text->CalcTextSizeA(0.8f * size, 1e6f, 0, control.shown).x;
  const ImU32 text = on ? Colours().on_accent : Colours().text;
  list->AddText(fonts.text, size, {at.x + pad, y}, text, control.label);
  list->AddText(fonts.text, 0.8f * size, {at.x + width - pad - key_width, y + 0.1f * size},
                on ? Colours().on_accent : Colours().dim, control.shown);
  return pressed;
}

void DrawTools(const PanelContext& context, const Rect& rect) {
  Desk& desk = context.desk;
  BeginPanel("tools", rect, Colours().panel, true);
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(0, 3 * context.scale));
  const float width = ImGui::GetContentRegionAvail().x;
  bool commands = false;
  for (const tools::Control& control : tools::Controls()) {
    if (control.group != tools::Group::kTool && control.group != tools::Group::kCommand) continue;
    if (control.group == tools::Group::kCommand && !commands) {
      commands = true;
      ImGui::Dummy({0, 8 * context.scale});
    }
    using enum tools::Action;
    const bool on = control.action == desk.state().tool ||
                    (control.action == kFreeze && desk.state().still) ||
                    (control.action == kFollow && desk.state().following) ||
                    (control.action == kReset && desk.state().confirming_reset);
    if (ControlButton(control, on, width, context.fonts)) desk.Run(control.action, context.now_ns);
    const ImVec2 beside{ImGui::GetItemRectMax().x + 14 * context.scale, ImGui::GetItemRectMin().y};
    const std::string refusal = desk.state().Refusal(control.label);
    const bool asks = control.action == kReset && desk.state().confirming_reset;
    if (refusal.empty() && !asks) continue;
    ImGui::SetNextWindowPos(beside);
    ImGui::PushStyleColor(ImGuiCol_WindowBg, Colours().raised);
    ImGui::Begin(absl::StrCat("beside ", control.label).c_str(), nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    if (asks) {
      Colored(Colours().warn, "Forget the map? Marks pause until their place is known again.");
      ImGui::PushStyleColor(ImGuiCol_Button, Colours().line);
      if (ImGui::Button("Forget it")) desk.ConfirmReset(true, context.now_ns);
      ImGui::SameLine(0, 8 * context.scale);
      if (ImGui::Button("Keep it")) desk.ConfirmReset(false, context.now_ns);
      ImGui::PopStyleColor();
    } else {
      Colored(Colours().warn, refusal);
    }
    NoteAbove(desk);
    ImGui::End();
    ImGui::PopStyleColor();
  }
  ImGui::PopStyleVar();
  EndPanel();
}

void DrawStrip(const PanelContext& context, const Rect& rect) {
  const session::State& state = context.desk.session();
  BeginPanel("strip", rect, Colours().bar);
  ImGui::SetCursorPosY(0.5f * (rect.height - ImGui::GetFontSize()));
  for (std::size_t i = 0; i + 1 < session::kStages; ++i) {
    const auto times = context.desk.latency().Get(static_cast<session::Stage>(i));
    const bool known = times && state.link.live();
    Colored(Colours().dim, session::kStageNames[i]);
    ImGui::SameLine(0, 5 * context.scale);
    Colored(Colours().text, known ? absl::StrFormat("%3.0f", times->p50) : "  –");
    if (known && ImGui::IsItemHovered()) {
      ImGui::SetTooltip("%s: median %.1f ms, 95 %% below %.1f ms", session::kStageNames[i],
                        times->p50, times->p95);
    }
    ImGui::SameLine(0, 14 * context.scale);
  }
  Colored(Colours().dim, "ms");
  if (state.statistics && state.link.live()) {
    const net::Statistics& told = *state.statistics;
    std::string words;
    const auto lost = [&words](std::uint64_t count, const char* what) {
      if (count > 0) absl::StrAppend(&words, count, " ", what, count == 1 ? "" : "s", " · ");
    };
    lost(told.bad_frames, "bad frame");
    lost(told.frames_dropped, "untracked frame");
    lost(told.events_skipped, "skipped event");
    absl::StrAppendFormat(&words, "tracked %.0f Hz · %.1f Mbit/s", told.tracked_fps_hz,
                          1e-6 * told.video_bit_rate_bit_s);
    const float width = ImGui::CalcTextSize(words.c_str()).x;
    ImGui::SameLine();
    const float at = rect.width - width - 12 * context.scale;
    if (at > ImGui::GetCursorPosX()) {
      ImGui::SetCursorPosX(at);
      Colored(Colours().dim, words);
    }
  }
  EndPanel();
}

}  // namespace saccade::view
