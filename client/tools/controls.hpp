#pragma once

#include <optional>
#include <span>
#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade::tools {

/// What keys and buttons do: the same keys as the page's (web/src/tools/tools.ts).
enum class Action {
  // What a click in the video or the map does.
  kSelect,
  kArea,
  kLaser,
  kInk,
  kCube,
  kBox,
  kNote,
  kArrow,
  kPin,
  kMeasure,
  kCheckList,
  kPicture,
  kThings,
  kGaze,
  // What happens at once.
  kUndo,
  kRedo,
  kDelete,
  kCopy,
  kPaste,
  kLock,
  kFreeze,
  kSwap,
  kFollow,
  kWholeMap,
  kTop,
  kReset,
  // The head.
  kStop,
  kHome,
  kLevel,
  kExplore,
  kFast,
  kLease,
  // The marks as a whole.
  kOnlyMine,
  kHideMarks,
  kSnapshot,
  // Keys alone.
  kTurnLeft,
  kTurnRight,
  kSelectAll,
  kEditText,
  kFind,
  kMessage,
  kVoice,
  kMute,
  kShow,
  kTheme,
  kHelp,
  kEscape,
  kNextTab,
};
enum class Group { kTool, kCommand, kHead, kMarks, kKeys };

struct Control {
  Action action;
  Group group;
  const char* label;
  const char* key;    // lower case letter, digit, "delete", "escape"; after "ctrl+" with Ctrl
  const char* shown;  // on the button
  const char* hint;
};

/// All of them, in the order in which they are shown.
std::span<const Control> Controls();
const Control& ControlOf(Action action);

struct KeyPress {
  std::string key;  // as Control::key; other names mean nothing
  bool ctrl = false, alt = false, super = false, shift = false;
};
/// Nothing for keys that do nothing here.
std::optional<Action> ActionOf(const KeyPress& press);

/// What a click places with that tool; nothing: it places nothing.
std::optional<AnnotationShape> ShapeOf(Action tool);

}  // namespace saccade::tools
