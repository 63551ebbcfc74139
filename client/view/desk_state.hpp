#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/decode/player.hpp"
#include "client/tools/controls.hpp"
#include "client/tools/landing.hpp"
#include "client/tools/marks.hpp"
#include "client/tools/selection.hpp"
#include "client/view/layout.hpp"
#include "client/view/surface_layer.hpp"
#include "client/view/thing_desk.hpp"

namespace saccade::view {

enum class Pane { kMap, kVideo };

/// Where a refusal is shown: beside what could not be done. A control's label, "map", "video",
/// "head", or "annotation " and its id.
using Where = std::string;

struct Hover {
  Pane pane = Pane::kMap;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of the pane's view
  std::optional<tools::Landing> landing;
};

/// A picture held on the screen, with the features of its map.
struct Still {
  decode::Picture picture;
  tools::Features features;
  std::uint64_t map_revision = 0;
  Timestamp since_ns = 0;
  bool lossless = false;  // the server's own, by GetFrame
};

/// A rectangle that is drawn round marks [px of the pane's view].
struct Area {
  Pane pane = Pane::kMap;
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
};

/// A note that is written, or a mark's text that is changed.
struct TextEditor {
  std::optional<tools::Landing> landing;  // of a new note
  std::string id;                         // of a mark that is there; empty: a new note
  Pane pane = Pane::kMap;
  float x = 0, y = 0;  // in the window
  std::string text;
  bool opened = false;  // has had the keyboard
  bool finish = false;  // Enter was pressed; what was typed before it may still be on its way
};

/// A check list or a picture that is to be placed.
struct PlacingDialog {
  AnnotationShape shape = AnnotationShape::kCheckList;
  tools::Landing landing;
  Pane pane = Pane::kMap;
  std::string title;
  std::string lines;     // of a check list
  std::string file;      // of a picture
  int page = 1;          // of a PDF
  bool loading = false;  // the file is being read
  std::string problem;   // what of it cannot be kept
  bool opened = false;   // has had the keyboard
  bool finish = false;   // it was asked to be placed; what was typed before it may be on its way
};

/// Marks to be put somewhere else, as they were when they were copied.
struct CopiedMark {
  Annotation mark;
  Eigen::Vector3d offset_in_world = Eigen::Vector3d::Zero();  // from the first one [m]
};

/// What is written to the others.
struct TalkField {
  bool open = false;
  bool wanted = false;   // the field wants the keyboard
  bool carries = false;  // the selected mark goes with the message
  bool writing = false;  // has the keyboard
  int field = 0;         // rises with each change from outside: ImGui keeps a copy of its own
  bool finish = false;   // Enter was pressed; what was typed before it may still be on its way
  std::string text;
  std::string problem;
};

/// What this person is doing with one wearer. The thread that draws.
class DeskState {
 public:
  tools::Action tool = tools::Action::kSelect;
  tools::Selection selection;
  std::string pointed_id;
  std::optional<Hover> hover;
  Pane main = Pane::kMap;
  MapShows shows = MapShows::kBoth;
  bool from_above = false;  // the map was last looked at from above
  bool confirming_reset = false;
  tools::MarkFilter filter;
  bool hide_marks = false;
  std::set<std::string> hidden;  // marks that are not drawn until they are selected
  std::string my_name;
  std::uint32_t color_rgba = 0xffffffff;  // of new marks
  bool fast = false;                      // the head turns as fast as it can
  bool following = false;
  bool find = false;  // the field wants the keyboard
  std::optional<Still> still;
  std::optional<TextEditor> editor;
  std::optional<PlacingDialog> dialog;
  TalkField talk;
  ThingDesk things;
  std::vector<CopiedMark> copied;
  std::vector<Rect> above;  // what lies over the panes, of the picture on the screen
  tools::InkLine ink;
  std::optional<Area> area;
  /// Where keys point in the video, as shares of the picture; nothing: the pointer does.
  std::optional<Eigen::Vector2d> key_place;
  std::optional<tools::Landing> measure_from;  // one end of a distance, until the other is clicked
  /// What the camera was asked to look at, until the server says that it does.
  std::optional<Eigen::Vector3d> asked_in_world;

  /// True if it is drawn: a selected one always is.
  bool Draws(const Annotation& annotation) const {
    if (selection.Has(annotation.id)) return true;
    return !hide_marks && !hidden.contains(annotation.id) &&
           tools::Passes(annotation, filter, my_name);
  }
  bool hides() const { return hide_marks || !hidden.empty(); }

  void Refuse(const Where& where, const std::string& text, Timestamp now_ns) {
    refusals_[where] = {text, now_ns + 6'000'000'000};
  }
  /// Empty: nothing was refused there of late.
  std::string Refusal(const Where& where) const {
    const auto found = refusals_.find(where);
    return found == refusals_.end() ? "" : found->second.text;
  }
  /// Forgets refusals that have been read; true if there were any.
  bool Expire(Timestamp now_ns) {
    return std::erase_if(refusals_, [now_ns](const auto& entry) {
             return entry.second.until_ns <= now_ns;
           }) > 0;
  }
  bool refusing() const { return !refusals_.empty(); }

 private:
  struct Refused {
    std::string text;
    Timestamp until_ns = 0;
  };
  std::map<Where, Refused> refusals_;
};

}  // namespace saccade::view
