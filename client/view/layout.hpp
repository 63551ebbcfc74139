#pragma once

#include <cstdint>

namespace saccade::view {

/// In the window's own units (GLFW screen coordinates), from its top left corner.
struct Rect {
  float x = 0, y = 0, width = 0, height = 0;
  bool Contains(float px, float py) const {
    return px >= x && py >= y && px < x + width && py < y + height;
  }
  float right() const { return x + width; }
  float bottom() const { return y + height; }
};

/// What a person can set by dragging; kept between two runs. Units at scale 1.
struct LayoutSettings {
  float panel_width = 300;    // right column
  float inset_share = 0.34f;  // of the main pane's width
  bool talk_open = false;
  static constexpr float kLeastPanel = 220, kMostPanel = 560;
  static constexpr float kLeastInset = 0.18f, kMostInset = 0.6f;
};

/// Of the main pane, where the inset stands.
enum class Corner { kSouthEast, kSouthWest, kNorthEast, kNorthWest };

/// Where everything stands in the window.
struct Layout {
  Rect header, tabs, tools, main, inset, panel, talk, gaze, strip;
  Rect panel_edge, inset_edge;  // what is dragged
  Corner corner = Corner::kSouthEast;
  float scale = 1;
};

/// For a window of `width` x `height`; `scale` as of the monitor's content; `tabs`: more than one
/// server; `aspect`: width by height of what the inset shows. The main pane never has less than a
/// third of the window's width.
Layout LayOut(float width, float height, float scale, bool tabs, float aspect,
              const LayoutSettings& settings, Corner corner = Corner::kSouthEast);

/// The inset over the map: never for long over the wearer's camera, and still otherwise.
class InsetCorner {
 public:
  Corner corner() const { return corner_; }
  /// `x`, `y`: where that camera appears in the window; `shown`: it does, in the main pane.
  void Update(const Layout& layout, bool shown, float x, float y, std::int64_t now_ns);

 private:
  Corner corner_ = Corner::kSouthEast;
  std::int64_t covered_ns_ = 0;  // since when; 0: it is not
};

/// Settings after one of the edges was dragged to a point; within their bounds.
void DragPanelEdge(const Layout& layout, float x, float width, LayoutSettings& settings);
void DragInsetEdge(const Layout& layout, float x, LayoutSettings& settings);

}  // namespace saccade::view
