#include "client/view/layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "client/view/picture_file.hpp"
#include "client/view/theme.hpp"

namespace saccade::view::layout_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(Layout, ThePaneIsAtLeastAThirdOfTheWindowAndNothingOverlapsAtAnySize) {
  constexpr std::array<std::array<float, 3>, 6> kSizes = {{{640, 400, 1},
                                                           {1280, 720, 1},
                                                           {1280, 720, 2},
                                                           {2560, 1440, 1},
                                                           {2560, 1440, 2},
                                                           {3440, 1440, 1.5}}};
  for (const auto& [width, height, scale] : kSizes) {
    SCOPED_TRACE(::testing::Message() << width << " x " << height << " at " << scale);
    LayoutSettings settings;
    settings.talk_open = scale != 1;
    const Layout out = LayOut(width, height, scale, true, 4.0f / 3, settings);
    EXPECT_GE(out.main.width, width / 3 - 1);
    EXPECT_FLOAT_EQ(out.tools.right(), out.main.x);
    EXPECT_FLOAT_EQ(out.main.right(), out.panel.x);
    EXPECT_FLOAT_EQ(out.panel.right(), width);
    EXPECT_FLOAT_EQ(out.tabs.bottom(), out.main.y);
    EXPECT_FLOAT_EQ(out.panel.bottom(), out.talk.y);
    EXPECT_FLOAT_EQ(out.talk.bottom(), out.gaze.y);
    EXPECT_GT(out.panel.height, 0.1f * height);
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

/// WCAG 2.2.
double Luminance(ImU32 color) {
  const auto linear = [color](int shift) {
    const double c = (color >> shift & 0xff) / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(IM_COL32_R_SHIFT) + 0.7152 * linear(IM_COL32_G_SHIFT) +
         0.0722 * linear(IM_COL32_B_SHIFT);
}

TEST(Theme, WordsHaveAContrastOfFourAndAHalfOnEverythingTheyStandOn) {
  for (const Palette& palette : {kDark, kLight}) {
    const auto contrast = [](ImU32 a, ImU32 b) {
      const double la = Luminance(a), lb = Luminance(b);
      return (std::max(la, lb) + 0.05) / (std::min(la, lb) + 0.05);
    };
    for (const ImU32 ground : {palette.bar, palette.panel, palette.raised}) {
      for (const ImU32 words : {palette.text, palette.dim, palette.accent, palette.warn}) {
        EXPECT_GE(contrast(words, ground), 4.5) << std::hex << words << " on " << ground;
      }
    }
    EXPECT_GE(contrast(palette.on_accent, palette.accent), 4.5);
    EXPECT_GE(contrast(palette.text, palette.line), 4.5) << "of a button";
  }
}

class PictureFile : public ::testing::Test {
 protected:
  PictureFile() { fs::create_directories(folder_); }
  ~PictureFile() override { fs::remove_all(folder_); }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }
  const fs::path folder_ =
      fs::path(::testing::TempDir()) / ("picture-files-" + std::to_string(::getpid()));
};

TEST_F(PictureFile, IsFittedIntoWhatTheServerKeeps) {
  cv::Mat noise(420, 4200, CV_8UC3);
  cv::randu(noise, 0, 256);
  const std::string file = (folder_ / "noise.png").string();
  ASSERT_TRUE(cv::imwrite(file, noise, {cv::IMWRITE_PNG_COMPRESSION, 1}));
  const auto picture = LoadPicture(file);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_LE((*picture)->bytes.size(), 1u << 20);
  EXPECT_LE((*picture)->width, 4096);
  EXPECT_EQ((*picture)->media_type, "image/jpeg");
  EXPECT_NEAR(1.0 * (*picture)->width / (*picture)->height, 10, 0.1);
}

TEST_F(PictureFile, ASmallOneStaysAsItIsPixelForPixel) {
  cv::Mat small(40, 60, CV_8UC4, cv::Scalar(10, 200, 30, 128));
  const std::string file = (folder_ / "small.png").string();
  ASSERT_TRUE(cv::imwrite(file, small));
  const auto picture = LoadPicture(file);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ((*picture)->media_type, "image/png");
  const std::string& bytes = (*picture)->bytes;
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  const cv::Mat read = cv::imdecode(raw, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.type(), small.type());
  EXPECT_EQ(cv::norm(read, small, cv::NORM_INF), 0);
}

TEST_F(PictureFile, WhatIsNoneIsRefusedInWords) {
  EXPECT_THAT(std::string(LoadPicture("").status().message()),
              HasSubstr("name a PNG, JPEG or PDF"));
  EXPECT_THAT(std::string(LoadPicture("/nowhere.png").status().message()),
              HasSubstr("there is no file /nowhere.png"));
  EXPECT_THAT(std::string(LoadPicture(Write("a.txt", "hello")).status().message()),
              HasSubstr("is no PNG, no JPEG and no PDF"));
  EXPECT_THAT(std::string(LoadPicture(Write("b.png", "\x89PNG\r\n\x1a\nrest")).status().message()),
              HasSubstr("is damaged"));
}

}  // namespace
}  // namespace saccade::view::layout_test
