#pragma once

#include <optional>

#include "client/view/desk_view.hpp"
#include "client/view/layout.hpp"
#include "client/view/window.hpp"

namespace saccade::view {

/// What pointer and keys do in the panes: orbit, pan, zoom, clicks, strokes, edges that are
/// dragged. Events mean what was on the screen when they happened: to be called before a new
/// picture is taken. One thread.
class Pointer {
 public:
  /// `over_panes`: nothing of ImGui's lies over them there.
  void Handle(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view,
              bool over_panes, LayoutSettings& settings, Timestamp now_ns);
  /// Arrow keys (in the map they move the eye, in the video the place that Enter clicks), plus and
  /// minus, Enter. What Enter takes hold of the next one lets go. True if it was one of them.
  bool HandleKey(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view,
                 Timestamp now_ns);
  /// What keys hold is given up.
  void LetGo() { held_by_key_.reset(); }
  /// Where the pointer is, else in the middle of the large pane.
  void Paste(const Layout& layout, Desk& desk, const DeskView& view, Timestamp now_ns);
  /// Over an edge that can be dragged, or dragging it.
  bool over_edge() const { return over_edge_; }

 private:
  enum class What { kNothing, kPanelEdge, kInsetEdge, kOrbit, kPan, kPane };
  struct Target {
    Pane pane = Pane::kMap;
    Rect rect;
  };
  struct Place {
    Eigen::Vector2d pixel;
    std::optional<tools::View> view;
    double pick_px = 0;
    bool inside = false;
  };
  static std::optional<Target> PaneAt(float x, float y, const Layout& layout, const Desk& desk);
  static Place PlaceAt(float x, float y, const Target& target, const Desk& desk,
                       const DeskView& view, float scale);
  struct KeyPlace {
    Target target;
    float x = 0, y = 0;
  };
  /// Where keys point: the middle of the map, a place of their own in the video.
  static KeyPlace KeyPlaceOf(const Layout& layout, const Desk& desk, const DeskView& view);
  void Enter(const InputEvent& event, const KeyPlace& at, float scale, Desk& desk,
             const DeskView& view, Timestamp now_ns);
  static bool MoveKeyPlace(const std::string& key, bool far, Desk& desk);
  static bool MoveEye(const std::string& key, bool pans, Desk& desk);
  void Press(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view);
  void Move(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view,
            LayoutSettings& settings, bool over_panes);
  void Release(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view,
               Timestamp now_ns);

  What what_ = What::kNothing;
  std::optional<Pane> held_by_key_;
  Target target_;  // of the pane that was pressed
  float start_x_ = 0, start_y_ = 0, last_x_ = 0, last_y_ = 0;
  bool moved_ = false, over_edge_ = false;
};

}  // namespace saccade::view
