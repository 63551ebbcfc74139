#include "client/view/layout.hpp"

#include <algorithm>

namespace saccade::view {
namespace {

constexpr float kHeader = 38, kTabs = 30, kStrip = 26, kTools = 108, kGaze = 236, kMargin = 14;
constexpr float kEdge = 6;  // half of what can be gripped

}  // namespace

Layout LayOut(float width, float height, float scale, bool tabs, float aspect,
              const LayoutSettings& settings) {
  Layout out;
  out.scale = scale;
  const float header = kHeader * scale, strip = kStrip * scale;
  const float tab_height = tabs ? kTabs * scale : 0;
  out.header = {0, 0, width, header};
  out.tabs = {0, header, width, tab_height};
  out.strip = {0, height - strip, width, strip};
  const float top = header + tab_height;
  const float body = std::max(height - top - strip, 1.0f);
  out.tools = {0, top, kTools * scale, body};
  const float most_panel = std::max(width - out.tools.width - width / 3, 1.0f);
  const float panel = std::min(settings.panel_width * scale, most_panel);
  const float gaze = std::min(kGaze * scale, 0.5f * body);
  out.panel = {width - panel, top, panel, body - gaze};
  out.gaze = {width - panel, top + body - gaze, panel, gaze};
  out.main = {out.tools.width, top, std::max(width - panel - out.tools.width, 1.0f), body};
  out.panel_edge = {out.panel.x - kEdge * scale, top, 2 * kEdge * scale, body};
  const float margin = kMargin * scale;
  float inset_width = settings.inset_share * out.main.width;
  float inset_height = inset_width / std::max(aspect, 0.1f);
  if (inset_height > 0.6f * body) {
    inset_height = 0.6f * body;
    inset_width = inset_height * aspect;
  }
  out.inset = {out.main.right() - margin - inset_width, out.main.bottom() - margin - inset_height,
               inset_width, inset_height};
  out.inset_edge = {out.inset.x - kEdge * scale, out.inset.y, 2 * kEdge * scale, inset_height};
  return out;
}

void DragPanelEdge(const Layout& layout, float x, float width, LayoutSettings& settings) {
  settings.panel_width = std::clamp((width - x) / layout.scale, LayoutSettings::kLeastPanel,
                                    LayoutSettings::kMostPanel);
}

void DragInsetEdge(const Layout& layout, float x, LayoutSettings& settings) {
  settings.inset_share = std::clamp((layout.inset.right() - x) / layout.main.width,
                                    LayoutSettings::kLeastInset, LayoutSettings::kMostInset);
}

}  // namespace saccade::view
