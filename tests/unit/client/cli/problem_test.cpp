#include "client/cli/problem.hpp"

#include <gtest/gtest.h>

namespace saccade::cli::problem_test {
namespace {

std::string Say(const Options& options, const std::string& message) {
  return ProblemText(options, absl::InvalidArgumentError(message));
}

Options Annotate(AnnotationTarget target) {
  Options options;
  options.command = Command::kAnnotate;
  options.draft.target = std::move(target);
  return options;
}

TEST(Problem, NamesTheFlagThatWasTyped) {
  const Options pixel = Annotate(PixelTarget{});
  EXPECT_EQ(
      Say(pixel, "draft.target.frame_pixel.pixel.u: 5000 is outside the picture (-0.5 to 319.5)"),
      "--pixel: u 5000 is outside the picture (-0.5 to 319.5)");
  EXPECT_EQ(
      Say(pixel,
          "target.frame_pixel.pixel (5000.0, 10.0) is outside the picture, which is 640 x 480"),
      "--pixel: (5000.0, 10.0) is outside the picture, which is 640 x 480");
  EXPECT_EQ(Say(pixel, "draft.ink_px[3].v: -4 is outside the picture (-0.5 to 239.5)"),
            "--stroke: point 4, v -4 is outside the picture (-0.5 to 239.5)");
  EXPECT_EQ(Say(pixel, "draft.text: at most 500 bytes, not 501"),
            "--text: at most 500 bytes, not 501");
  EXPECT_EQ(Say(pixel, "draft.size_m: 11 is not between 0.001 and 10"),
            "--size: 11 is not between 0.001 and 10");
  EXPECT_EQ(Say(Annotate(PointTarget{}), "draft.target.point_in_world_m.x: 1e+09 is beyond 10000"),
            "--point: x 1e+09 is beyond 10000");
  EXPECT_EQ(Say(Annotate(FeatureTarget{}), "target.feature_id 7 is not in the map (any more)"),
            "--feature: 7 is not in the map (any more)");
  EXPECT_EQ(Say(pixel, "display_name: at most 60 bytes, not 70"),
            "--name: at most 60 bytes, not 70");

  Options fixate;
  fixate.command = Command::kFixate;
  fixate.gaze = GazePoint{{0, 0, 700}};
  EXPECT_EQ(Say(fixate, "target: 700.0 m away; a target is at most 30 m from the wearer"),
            "--point: 700.0 m away; a target is at most 30 m from the wearer");
  fixate.gaze = GazeAnnotation{"6f1c"};
  EXPECT_EQ(Say(fixate, "target.annotation_id: 6f1c does not exist"),
            "--annotation: 6f1c does not exist");
}

TEST(Problem, LeavesSentencesAsTheyAre) {
  const Options options;
  for (const char* sentence :
       {"no server answers at 127.0.0.1:1; start saccade-server", "frame 12 is no longer kept",
        "localhost:50051 did not answer within 5.0 s",
        "wearable.local:50051 did not answer within 5.0 s", "gaze: acquire the lease first",
        "text has to be said", ""}) {
    EXPECT_EQ(Say(options, sentence), sentence);
  }
  EXPECT_EQ(Say(options, "session_id: a viewer changes nothing"),
            "session id: a viewer changes nothing");
}

TEST(Problem, IsOneLineWhateverTheServerSent) {
  const std::string said = Say(Options(), "a\nb\x1b[31mc\r" + std::string(9000, 'x'));
  EXPECT_EQ(said.substr(0, 9), "a b [31mc");
  EXPECT_LE(said.size(), 2000u);
  for (const char* odd : {"[", "ink_px[", "draft.ink_px[99999999999999999].u: x", "a[b]: x",
                          "draft.: x", "target. x"}) {
    EXPECT_EQ(Say(Options(), odd).find('\n'), std::string::npos) << odd;
  }
}

TEST(Problem, IsJsonWhereAnswersAre) {
  EXPECT_EQ(ProblemJson(absl::StatusCode::kNotFound, "no").dump(),
            R"({"error":{"code":"NOT_FOUND","message":"no"}})");
}

}  // namespace
}  // namespace saccade::cli::problem_test
