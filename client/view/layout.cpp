#include "client/view/layout.hpp"

#include <algorithm>
#include <cmath>

namespace saccade::view {
namespace {

constexpr float kHeader = 38, kTabs = 30, kStrip = 26, kTools = 142, kGaze = 236, kMargin = 14;
constexpr float kTalkHead = 34, kTalk = 260;
constexpr float kRoom = 24;  // round the camera: its picture is drawn there
constexpr std::int64_t kPatienceNs = 500'000'000;
constexpr float kEdge = 6;  // half of what can be gripped

Rect InsetAt(Corner corner, const Rect& main, float width, float height, float margin) {
  const bool east = corner == Corner::kSouthEast || corner == Corner::kNorthEast;
  const bool south = corner == Corner::kSouthEast || corner == Corner::kSouthWest;
  return {east ? main.right() - margin - width : main.x + margin,
          south ? main.bottom() - margin - height : main.y + margin, width, height};
}

}  // namespace

Layout LayOut(float width, float height, float scale, bool tabs, float aspect,
              const LayoutSettings& settings, Corner corner) {
  Layout out;
  out.corner = corner;
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
  const float talk = settings.talk_open ? std::floor(std::min(kTalk * scale, 0.35f * body))
                                        : std::floor(std::min(kTalkHead * scale, 0.1f * body));
  out.panel = {width - panel, top, panel, body - gaze - talk};
  out.talk = {width - panel, out.panel.bottom(), panel, talk};
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
  out.inset = InsetAt(corner, out.main, inset_width, inset_height, margin);
  const bool east = corner == Corner::kSouthEast || corner == Corner::kNorthEast;
  out.inset_edge = {(east ? out.inset.x : out.inset.right()) - kEdge * scale, out.inset.y,
                    2 * kEdge * scale, inset_height};
  return out;
}

void DragPanelEdge(const Layout& layout, float x, float width, LayoutSettings& settings) {
  settings.panel_width = std::clamp((width - x) / layout.scale, LayoutSettings::kLeastPanel,
                                    LayoutSettings::kMostPanel);
}

void DragInsetEdge(const Layout& layout, float x, LayoutSettings& settings) {
  const bool east = layout.inset_edge.x < layout.inset.x;
  const float width = east ? layout.inset.right() - x : x - layout.inset.x;
  settings.inset_share = std::clamp(width / layout.main.width, LayoutSettings::kLeastInset,
                                    LayoutSettings::kMostInset);
}

void InsetCorner::Update(const Layout& layout, bool shown, float x, float y, std::int64_t now_ns) {
  const float margin = kMargin * layout.scale, room = kRoom * layout.scale;
  const auto covers = [&](Corner corner) {
    const Rect at = InsetAt(corner, layout.main, layout.inset.width, layout.inset.height, margin);
    return Rect{at.x - room, at.y - room, at.width + 2 * room, at.height + 2 * room}.Contains(x, y);
  };
  if (!shown || !covers(corner_)) {
    covered_ns_ = 0;
    return;
  }
  if (covered_ns_ == 0) covered_ns_ = now_ns;
  if (now_ns - covered_ns_ < kPatienceNs) return;
  for (const Corner corner :
       {Corner::kSouthEast, Corner::kSouthWest, Corner::kNorthEast, Corner::kNorthWest}) {
    if (covers(corner)) continue;
    corner_ = corner;
    break;
  }
  covered_ns_ = 0;
}

}  // namespace saccade::view
