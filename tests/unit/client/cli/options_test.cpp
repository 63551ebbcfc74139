#include "client/cli/options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace saccade::cli::options_test {
namespace {

ParseResult Parse(const std::vector<const char*>& arguments) {
  std::vector<const char*> argv = {"saccade"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return ParseCommandLine(static_cast<int>(argv.size()), argv.data());
}

TEST(CommandLine, HelpAndVersionEndWithSuccess) {
  for (const char* argument : {"--help", "--version"}) {
    const ParseResult result = Parse({argument});
    EXPECT_FALSE(result.options);
    EXPECT_EQ(result.exit_code, 0) << argument;
  }
}

TEST(CommandLine, BadUsageEndsWithTwo) {
  const std::vector<std::vector<const char*>> wrong = {
      {},
      {"bogus"},
      {"status", "extra"},
      {"--server", "nowhere", "status"},
      {"--server", "host:0", "status"},
      {"--server", "host:65536", "status"},
      {"--timeout", "0", "status"},
      {"annotate"},
      {"annotate", "--pixel", "1"},
      {"annotate", "--pixel", "1,nan"},
      {"annotate", "--pixel", "1,inf"},
      {"annotate", "--pixel", "1,2,3"},
      {"annotate", "--pixel", "1,2", "--feature", "3"},
      {"annotate", "--feature", "-3"},
      {"annotate", "--feature", "3", "--frame", "7"},
      {"annotate", "--feature", "3", "--shape", "sphere"},
      {"annotate", "--pixel", "1,2", "--shape", "ink"},
      {"annotate", "--pixel", "1,2", "--stroke", "1,2,3,4"},
      {"annotate", "--pixel", "1,2", "--size", "11"},
      {"annotate", "--pixel", "1,2", "--color", "orange"},
      {"annotate", "--pixel", "1,2", "--color", "0xff00"},
      {"annotate", "--pixel", "1,2", "--color", "ff9a3dff"},
      {"annotate", "--pixel", "1,2", "--shape", "measure"},
      {"annotate", "--pixel", "1,2", "--to-pixel", "3,4"},
      {"annotate", "--pixel", "1,2", "--shape", "measure", "--to-pixel", "3"},
      {"annotate", "--pixel", "1,2", "--shape", "box", "--extent", "1,2"},
      {"annotate", "--pixel", "1,2", "--extent", "1,2,3"},
      {"annotate", "--pixel", "1,2", "--shape", "pin", "--rotation", "0,0,0,1"},
      {"annotate", "--pixel", "1,2", "--shape", "picture"},
      {"annotate", "--pixel", "1,2", "--shape", "picture", "--picture", "/no/such/file"},
      {"annotate", "--pixel", "1,2", "--shape", "check-list"},
      {"annotate", "--pixel", "1,2", "--item", "oil"},
      {"annotations", "tick", "6f1c"},
      {"annotations", "tick", "6f1c", "0"},
      {"annotations", "tick", "6f1c", "31"},
      {"annotations", "lock"},
      {"annotations", "picture", "6f1c"},
      {"snapshot", "--view", "raw"},
      {"snapshot", "--view", "rgb", "--out", "a.png"},
      {"annotations", "show"},
      {"annotations", "bogus"},
      {"watch", "--for", "-1"},
      {"watch", "--for", "nan"},
      {"annotate", "--pixel", "1,2", "--size", "nan"},
      {"annotate", "--pixel", "1,2", "--text", "\xff"},
  };
  for (const auto& arguments : wrong) {
    const ParseResult result = Parse(arguments);
    std::string line;
    for (const char* argument : arguments) line += std::string(" ") + argument;
    EXPECT_FALSE(result.options) << line;
    EXPECT_EQ(result.exit_code, kBadUsage) << line;
  }
}

TEST(CommandLine, WhatOnlySomeShapesHaveIsTaken) {
  const ParseResult box = Parse({"annotate", "--point", "0,0,1", "--shape", "box", "--extent",
                                 "0.1,0.2,0.3", "--rotation", "0,1,0,0"});
  ASSERT_TRUE(box.options);
  EXPECT_EQ(box.options->draft.shape, AnnotationShape::kBox);
  EXPECT_EQ(*box.options->draft.extent_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(box.options->draft.world_from_mark->y(), 1.0);
  const ParseResult measure =
      Parse({"annotate", "--pixel", "1,2", "--shape", "measure", "--to-feature", "9"});
  ASSERT_TRUE(measure.options);
  EXPECT_EQ(std::get<FeatureTarget>(*measure.options->draft.end_target).feature_id, 9u);
  const ParseResult list = Parse({"annotate", "--point", "0,0,1", "--shape", "check-list", "--item",
                                  "oil", "--item", "close the lid"});
  ASSERT_TRUE(list.options);
  EXPECT_EQ(list.options->draft.check_items, (std::vector<std::string>{"oil", "close the lid"}));
  const ParseResult tick = Parse({"annotations", "tick", "6f1c", "2", "--undone"});
  ASSERT_TRUE(tick.options);
  EXPECT_EQ(tick.options->command, Command::kTick);
  EXPECT_EQ(tick.options->line, 2u);
  EXPECT_TRUE(tick.options->untick);
}

TEST(CommandLine, TargetsOfAnAnnotationAreTaken) {
  const ParseResult pixel = Parse({"annotate", "--pixel", "319.5,239.5", "--frame", "7"});
  ASSERT_TRUE(pixel.options);
  EXPECT_EQ(std::get<PixelTarget>(pixel.options->draft.target).pixel,
            Eigen::Vector2d(319.5, 239.5));
  EXPECT_EQ(pixel.options->frame, FrameId{7});
  EXPECT_EQ(pixel.options->draft.shape, AnnotationShape::kCube);

  const ParseResult point = Parse({"annotate", "--point=-0.1,0,2", "--shape", "arrow"});
  ASSERT_TRUE(point.options);
  EXPECT_EQ(std::get<PointTarget>(point.options->draft.target).point_in_world,
            Eigen::Vector3d(-0.1, 0, 2));
  EXPECT_EQ(point.options->draft.shape, AnnotationShape::kArrow);

  const ParseResult feature =
      Parse({"annotate", "--feature", "12", "--shape", "note", "--text", "oil here"});
  ASSERT_TRUE(feature.options);
  EXPECT_EQ(std::get<FeatureTarget>(feature.options->draft.target).feature_id, 12u);
  EXPECT_EQ(feature.options->draft.text, "oil here");

  const ParseResult ink =
      Parse({"annotate", "--pixel", "1,2", "--shape", "ink", "--stroke", "1,2,3,4.5"});
  ASSERT_TRUE(ink.options);
  ASSERT_EQ(ink.options->draft.ink_px.size(), 2u);
  EXPECT_EQ(ink.options->draft.ink_px[1], Eigen::Vector2d(3, 4.5));
}

TEST(CommandLine, AnAnnotationHasTheColourAskedFor) {
  const ParseResult white = Parse({"annotate", "--pixel", "1,2"});
  ASSERT_TRUE(white.options);
  EXPECT_EQ(white.options->draft.color_rgba, 0xffffffffu);
  const ParseResult orange = Parse({"annotate", "--pixel", "1,2", "--color", "FF9a3d"});
  ASSERT_TRUE(orange.options);
  EXPECT_EQ(orange.options->draft.color_rgba, 0xff9a3dffu);
}

TEST(CommandLine, OptionsOfTheProgramMayFollowTheCommand) {
  const ParseResult result = Parse({"status", "--server", "wearable:6000", "--json"});
  ASSERT_TRUE(result.options);
  EXPECT_EQ(result.options->connection.server, "wearable:6000");
  EXPECT_TRUE(result.options->json);
}

TEST(CommandLine, CalibrateMountTakesAFileOrNone) {
  const ParseResult to_file = Parse({"calibrate-mount", "--out", "mount.toml"});
  ASSERT_TRUE(to_file.options);
  EXPECT_EQ(to_file.options->command, Command::kCalibrateMount);
  EXPECT_EQ(to_file.options->out, "mount.toml");
  EXPECT_TRUE(Parse({"calibrate-mount", "--json"}).options->json);
  EXPECT_EQ(Parse({"calibrate-mount", "now"}).exit_code, kBadUsage);
}

TEST(CommandLine, CalibrateCameraTakesATargetOrABoardWithItsSquare) {
  const ParseResult target = Parse({"calibrate-camera", "--source", "v4l2:/dev/video0", "--target",
                                    "charuco:7x5:0.04:0.03", "--form", "ros", "--out", "a.yaml"});
  ASSERT_TRUE(target.options);
  EXPECT_EQ(target.options->command, Command::kCalibrateCamera);
  EXPECT_EQ(target.options->record.target, "charuco:7x5:0.04:0.03");
  EXPECT_EQ(target.options->record.form, "ros");
  const std::vector<const char*> plain = {"calibrate-camera", "--source", "v4l2:/dev/video0",
                                          "--out", "a.yaml"};
  const auto with = [&](const std::vector<const char*>& more) {
    std::vector<const char*> words = plain;
    words.insert(words.end(), more.begin(), more.end());
    return Parse(words);
  };
  EXPECT_TRUE(with({"--board", "9x6", "--square", "0.025"}).options);
  EXPECT_EQ(with({"--board", "9x6"}).exit_code, kBadUsage);
  EXPECT_EQ(
      with({"--board", "9x6", "--square", "0.025", "--target", "chessboard:9x6:0.025"}).exit_code,
      kBadUsage);
}

TEST(CommandLine, AnnotationsMeansListUnlessToldOtherwise) {
  EXPECT_EQ(Parse({"annotations"}).options->command, Command::kListAnnotations);
  EXPECT_EQ(Parse({"annotations", "list"}).options->command, Command::kListAnnotations);
  EXPECT_EQ(Parse({"annotations", "undo"}).options->command, Command::kUndo);
  const ParseResult show = Parse({"annotations", "show", "6f1c"});
  ASSERT_TRUE(show.options);
  EXPECT_EQ(show.options->command, Command::kShowAnnotation);
  EXPECT_EQ(show.options->id, "6f1c");
}

}  // namespace
}  // namespace saccade::cli::options_test
