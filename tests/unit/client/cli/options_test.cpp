#include "client/cli/options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace saccade::cli {
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
}  // namespace saccade::cli
