#pragma once

#include <string>
#include <vector>

#include "client/view/desk.hpp"
#include "client/view/layout.hpp"
#include "client/view/theme.hpp"

/// Everything round the panes, by ImGui. Each reads the desk and calls what a person chose.
namespace saccade::view {

/// What all panels need.
struct PanelContext {
  Desk& desk;
  const Fonts& fonts;
  Timestamp now_ns = 0;
  float scale = 1;
};

/// What is watched, how tracking is and what to do about it, rates, who is here. True: the help was
/// asked for.
bool DrawHeader(const PanelContext& context, const Rect& rect);
/// One tab a server; returns the one to show.
std::size_t DrawTabs(const std::vector<Desk*>& desks, std::size_t shown, const Rect& rect,
                     Timestamp now_ns);
/// Tools and commands, the current one unmistakable, refusals beside what could not be done.
void DrawTools(const PanelContext& context, const Rect& rect);
/// Every annotation with its state and live error; the colour of new ones; finding them.
void DrawAnnotations(const PanelContext& context, const Rect& rect);
/// Things of the scene, in the annotations' place while their tool is in hand.
void DrawThings(const PanelContext& context, const Rect& rect);
/// Of it, what several clicks make: Done for a way, the pairs of a registration with its error.
void DrawThingWork(const PanelContext& context);
/// Of it, the marker that the selected thing moves with.
void DrawMarkerFixing(const PanelContext& context);
/// Remembers where what was just drawn of it is, for tests.
void NoteButton(Desk& desk, const std::string& words);
bool ThingButton(Desk& desk, const char* words, float width);
/// What the head does, how far off it is, who steers it, and what can be asked of it.
void DrawGaze(const PanelContext& context, const Rect& rect);
/// Where the time goes, and what was lost.
void DrawStrip(const PanelContext& context, const Rect& rect);
/// The field in which a note or a mark's text is written; nothing while none is.
void DrawEditor(const PanelContext& context, const Rect& within);
/// The fields for a check list or a picture that is to be placed; nothing while there is none.
void DrawDialog(const PanelContext& context, const Rect& within);
/// What people say, and a field to say something; folded to its head where `rect` is that low.
/// Joining the voices, mute, push to talk, who is there.
void DrawVoice(const PanelContext& context);
/// "● Ann speaks"; empty: nobody does.
std::string SpeakerWords(const Desk& desk);
void DrawTalk(const PanelContext& context, const Rect& rect);
/// What the keys do and what the colours mean, over everything. `open` false: does nothing.
void DrawHelp(const PanelContext& context, bool& open);

/// ImGui's fields, of text as it is written (UTF-8).
bool Field(const char* label, std::string& text, const char* hint = "",
           ImGuiInputTextFlags flags = 0);
bool LinesField(const char* label, std::string& text, const ImVec2& size,
                ImGuiInputTextFlags flags);
/// How it will be read, where a field cannot show that; else nothing.
void AsRead(const std::string& text);

/// Wrapped at the panel's edge; nothing of empty words.
void Wrapped(ImU32 color, const std::string& text);
/// A button with its key; true when pressed. `on`: it is the current one.
bool ControlButton(const tools::Control& control, bool on, float width, const Fonts& fonts);
/// A fixed, borderless window that fills `rect`.
bool BeginPanel(const char* name, const Rect& rect, ImU32 color, bool scrolls = false);
void EndPanel();
/// Clicks there are not for the panes: of the ImGui window that is being drawn.
void NoteAbove(Desk& desk);

}  // namespace saccade::view
