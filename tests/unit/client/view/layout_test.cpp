#include "client/view/layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace saccade::view {
namespace {

TEST(Layout, ThePaneIsAtLeastAThirdOfTheWindowAndNothingOverlapsAtAnySize) {
  constexpr std::array<std::array<float, 3>, 6> kSizes = {{{640, 400, 1},
                                                           {1280, 720, 1},
                                                           {1280, 720, 2},
                                                           {2560, 1440, 1},
                                                           {2560, 1440, 2},
                                                           {3440, 1440, 1.5}}};
  for (const auto& [width, height, scale] : kSizes) {
    SCOPED_TRACE(::testing::Message() << width << " x " << height << " at " << scale);
    const Layout out = LayOut(width, height, scale, true, 4.0f / 3, {});
    EXPECT_GE(out.main.width, width / 3 - 1);
    EXPECT_FLOAT_EQ(out.tools.right(), out.main.x);
    EXPECT_FLOAT_EQ(out.main.right(), out.panel.x);
    EXPECT_FLOAT_EQ(out.panel.right(), width);
    EXPECT_FLOAT_EQ(out.tabs.bottom(), out.main.y);
    EXPECT_FLOAT_EQ(out.panel.bottom(), out.gaze.y);
    EXPECT_FLOAT_EQ(out.gaze.bottom(), out.strip.y);
    EXPECT_NEAR(out.inset.width / out.inset.height, 4.0 / 3, 1e-3);
    EXPECT_TRUE(out.main.Contains(out.inset.x, out.inset.y));
    EXPECT_LE(out.inset.bottom(), out.main.bottom());
  }
}

TEST(Layout, EdgesThatAreDraggedStayWithinBounds) {
  LayoutSettings settings;
  const Layout out = LayOut(1280, 720, 1, false, 4.0f / 3, settings);
  DragPanelEdge(out, 1280 - 400, 1280, settings);
  EXPECT_FLOAT_EQ(settings.panel_width, 400);
  DragPanelEdge(out, 0, 1280, settings);
  EXPECT_FLOAT_EQ(settings.panel_width, LayoutSettings::kMostPanel);
  DragInsetEdge(out, out.inset.right() - 0.5f * out.main.width, settings);
  EXPECT_NEAR(settings.inset_share, 0.5f, 1e-4);
  DragInsetEdge(out, out.inset.right(), settings);
  EXPECT_FLOAT_EQ(settings.inset_share, LayoutSettings::kLeastInset);
}

TEST(InsetCorner, LeavesTheCameraAfterHalfASecondAndStaysWhereItIsOtherwise) {
  constexpr std::int64_t kMs = 1'000'000;
  InsetCorner inset;
  Layout out = LayOut(1280, 720, 1, false, 4.0f / 3, {}, inset.corner());
  const float x = out.inset.x + 20, y = out.inset.y + 20;
  inset.Update(out, true, x, y, 1000 * kMs);
  inset.Update(out, true, x, y, 1400 * kMs);
  EXPECT_EQ(inset.corner(), Corner::kSouthEast);
  inset.Update(out, true, x, y, 1600 * kMs);
  EXPECT_EQ(inset.corner(), Corner::kSouthWest);
  out = LayOut(1280, 720, 1, false, 4.0f / 3, {}, inset.corner());
  EXPECT_FALSE(out.inset.Contains(x, y));
  for (int i = 0; i < 20; ++i) inset.Update(out, true, x, y, (2000 + 100 * i) * kMs);
  EXPECT_EQ(inset.corner(), Corner::kSouthWest);
}

}  // namespace
}  // namespace saccade::view
