#include "client/tools/controls.hpp"

#include <algorithm>
#include <array>

namespace saccade::tools {
namespace {

using enum Action;
using enum Group;

constexpr auto kControls = std::to_array<Control>({
    {kSelect, kTool, "Select", "v", "V",
     "click a mark to select it, Shift for several; drag a selected one to move it"},
    {kArea, kTool, "Select several", "2", "2",
     "drag a rectangle round marks, or click one after the other"},
    {kLaser, kTool, "Laser pointer", "w", "W",
     "press and move: the others see where you point, until you let go"},
    {kInk, kTool, "Ink", "i", "I",
     "press and draw in the video or the map: everybody sees the stroke grow"},
    {kCube, kTool, "Cube", "c", "C", "click to place a cube, 5 cm where the scale is known"},
    {kBox, kTool, "Box", "b", "B", "drag from one corner to the other, or click for 10 cm"},
    {kNote, kTool, "Note", "n", "N", "click to place a note, then type"},
    {kArrow, kTool, "Arrow", "a", "A", "click to place an arrow"},
    {kPin, kTool, "Pin", "1", "1", "click to place a pin: the next number is its own"},
    {kMeasure, kTool, "Distance", "d", "D", "click both ends: the length, and how sure it is"},
    {kCheckList, kTool, "Check list", "j", "J", "click its place, then write what is to be done"},
    {kPicture, kTool, "Picture", "u", "U",
     "click its place, then name a picture or a PDF; or drop a file there"},
    {kThings, kTool, "Things", "4", "4",
     "furniture and machines to try: place them, push them to the wall"},
    {kGaze, kTool, "Look", "g", "G", "click what the camera should look at and hold"},
    {kUndo, kCommand, "Undo", "z", "Z", "take back your last change"},
    {kRedo, kCommand, "Redo", "y", "Y", "do it again"},
    {kDelete, kCommand, "Delete", "delete", "Del", "delete the selected marks"},
    {kCopy, kCommand, "Copy", "ctrl+c", "^C", "copy the selected marks (Ctrl C)"},
    {kPaste, kCommand, "Paste", "ctrl+v", "^V",
     "put the copied marks where the pointer is, in the map or the video (Ctrl V)"},
    {kLock, kCommand, "Lock", "3", "3",
     "only you and the wearer change a locked mark; again: unlock"},
    {kFreeze, kCommand, "Freeze", "p", "P", "hold the picture and click in it; again: go on"},
    {kSwap, kCommand, "Swap", "s", "S", "swap the map and the video"},
    {kFollow, kCommand, "Follow", "f", "F", "keep the wearer in view"},
    {kWholeMap, kCommand, "Whole map", "h", "H", "bring the whole map into view"},
    {kReset, kCommand, "Reset map", "r", "R", "forget the map and start anew"},
    {kStop, kHead, "Stop", "x", "X", "stop the head where it is"},
    {kHome, kHead, "Ahead", "0", "0", "look straight ahead (home)"},
    {kLevel, kHead, "Level", "l", "L", "keep the direction, and the picture level"},
    {kExplore, kHead, "Explore", "e", "E", "look round where the map is least certain"},
    {kFast, kHead, "Fast", "t", "T", "turn as fast as the head can"},
    {kLease, kHead, "Pilot", "q", "Q", "take the lease of the head, wait for it, or release it"},
    {kOnlyMine, kMarks, "Only mine", "o", "O", "list and draw only your marks"},
    {kHideMarks, kMarks, "Hide", "m", "M", "draw the selected marks no more, or none; again: all"},
    {kSnapshot, kMarks, "Snapshot", "k", "K", "keep the picture with its marks as a PNG"},
    {kTurnLeft, kKeys, "Turn", ",", ",", "turn the selected arrow or box"},
    {kTurnRight, kKeys, "Turn", ".", ".", "the other way; Shift: tip it"},
    {kSelectAll, kKeys, "Select all", "ctrl+a", "^A", "select every mark that is drawn (Ctrl A)"},
    {kEditText, kKeys, "Edit text", "f2", "F2", "change the text of the selected mark"},
    {kFind, kKeys, "Find", "/", "/", "find marks by text, shape, author"},
    {kMessage, kKeys, "Message", "9", "9", "write a message to everybody there"},
    {kVoice, kKeys, "Voice", "8", "8", "join the voices, or leave them"},
    {kMute, kKeys, "Mute", "7", "7", "not heard; again: heard"},
    {kShow, kKeys, "What the map shows", "5", "5", "surfaces and dots, surfaces, or dots alone"},
    {kTop, kKeys, "Where the map is seen from", "6", "6", "from above; again: all round"},
    {kTheme, kKeys, "Light", "f9", "F9", "a light window; again: a dark one"},
    {kHelp, kKeys, "Help", "?", "?", "what the keys do"},
    {kEscape, kKeys, "Leave", "escape", "Esc", "leave what is under way"},
    {kNextTab, kKeys, "Next wearer", "ctrl+tab", "^Tab", "show the next server's tab"},
});

}  // namespace

std::span<const Control> Controls() { return kControls; }

const Control& ControlOf(Action action) {
  return *std::find_if(kControls.begin(), kControls.end(),
                       [action](const Control& control) { return control.action == action; });
}

std::optional<Action> ActionOf(const KeyPress& press) {
  if (press.alt) return std::nullopt;
  if (press.ctrl || press.super) {
    if (press.key == "z") return press.shift ? kRedo : kUndo;
    if (press.key == "y") return kRedo;
    for (const Control& control : kControls) {
      if (control.key == "ctrl+" + press.key) return control.action;
    }
    return std::nullopt;
  }
  if (press.key == "backspace") return kDelete;
  if (press.key == ";" || press.key == "<") return kTurnLeft;
  if (press.key == ":" || press.key == ">") return kTurnRight;
  for (const Control& control : kControls) {
    if (press.key == control.key) return control.action;
  }
  return std::nullopt;
}

std::optional<AnnotationShape> ShapeOf(Action tool) {
  switch (tool) {
    case kInk:
      return AnnotationShape::kInk;
    case kCube:
      return AnnotationShape::kCube;
    case kBox:
      return AnnotationShape::kBox;
    case kPin:
      return AnnotationShape::kPin;
    case kMeasure:
      return AnnotationShape::kMeasure;
    case kCheckList:
      return AnnotationShape::kCheckList;
    case kPicture:
      return AnnotationShape::kPicture;
    case kNote:
      return AnnotationShape::kNote;
    case kArrow:
      return AnnotationShape::kArrow;
    default:
      return std::nullopt;
  }
}

}  // namespace saccade::tools
