#include "server/sim/sim_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace saccade::sim_options_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(SimOptions, EveryKeyIsRead) {
  const absl::StatusOr<SimOptions> options = SimOptions::FromUri(
      "sim:desk?seed=7&motion=walk&duration=2.5&noise=3&blur=off&auto_exposure=off&exposure_ms=4"
      "&width=320&height=240&fps=60&lens=pinhole&supersampling=2");
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_EQ(options->seed, 7u);
  EXPECT_EQ(options->motion, SimMotion::kWalk);
  EXPECT_DOUBLE_EQ(options->duration_s.value(), 2.5);
  EXPECT_DOUBLE_EQ(options->noise, 3);
  EXPECT_FALSE(options->blur);
  EXPECT_EQ(options->auto_exposure, SimExposure::kOff);
  EXPECT_NEAR(options->exposure_s, 0.004, 1e-12);
  EXPECT_EQ(options->width, 320);
  EXPECT_EQ(options->height, 240);
  EXPECT_DOUBLE_EQ(options->fps, 60);
  EXPECT_EQ(options->lens, LensModel::kPinhole);
  EXPECT_DOUBLE_EQ(options->supersampling, 2);
}

TEST(SimOptions, PlainUriMeansDefaults) {
  const absl::StatusOr<SimOptions> options = SimOptions::FromUri("sim:desk");
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->motion, SimMotion::kDesk);
  EXPECT_FALSE(options->duration_s.has_value());
  EXPECT_EQ(options->Intrinsics().model, LensModel::kBrownConrady);
}

TEST(SimOptions, RealSetsEverythingAndSingleKeysHaveTheLastWord) {
  const absl::StatusOr<SimOptions> options =
      SimOptions::FromUri("sim:desk?arm=off&jpeg=70&real=on&lens_error_px=3");
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_EQ(options->auto_exposure, SimExposure::kScene);
  EXPECT_EQ(options->start, SimStart::kTurn);
  EXPECT_GT(options->rolling_shutter_s, 0);
  EXPECT_GT(options->jitter_s, 0);
  EXPECT_LT(options->contrast, 1);
  EXPECT_FALSE(options->arm) << "though it stands before real=on";
  EXPECT_EQ(options->jpeg, 70);
  EXPECT_DOUBLE_EQ(options->lens_error_px, 3);
  const absl::StatusOr<SimOptions> plain = SimOptions::FromUri("sim:desk?real=off");
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->TrueIntrinsics().fx, plain->Intrinsics().fx);
  EXPECT_EQ(plain->TimeOf(7), 7.0 / 30.0);
}

TEST(SimOptions, TheFieldOfViewStaysWithTheSize) {
  SimOptions options;
  const double wide = options.Intrinsics().fx / options.width;
  options.width = 320;
  options.height = 240;
  EXPECT_NEAR(options.Intrinsics().fx / options.width, wide, 1e-12);
}

struct BadUri {
  const char* uri;
  const char* names;
  const char* remedy;
};

TEST(SimOptions, BadInputIsRefusedByNameWithARemedy) {
  for (const BadUri& bad : {
           BadUri{"sim:moon", "sim:moon", "sim:desk"},
           BadUri{"sim:desk?colour=red", "'colour'", "supersampling"},
           BadUri{"sim:desk?motion=fly", "motion=fly", "walk"},
           BadUri{"sim:desk?real=yes", "real=yes", "on or off"},
           BadUri{"sim:desk?auto_exposure=1", "auto_exposure=1", "scene"},
           BadUri{"sim:desk?start=fall", "start=fall", "turn"},
           BadUri{"sim:desk?jpeg=101", "jpeg=101", "100"},
           BadUri{"sim:desk?contrast=0", "contrast=0", "0.05"},
           BadUri{"sim:desk?rolling_shutter_ms=40", "rolling_shutter_ms=40", "33"},
           BadUri{"sim:desk?blur=yes", "blur=yes", "on or off"},
           BadUri{"sim:desk?seed=-1", "seed=-1", "whole number"},
           BadUri{"sim:desk?seed=", "seed=", "whole number"},
           BadUri{"sim:desk?fps=nan", "fps=nan", "number"},
           BadUri{"sim:desk?fps=0", "fps=0", "1 .. 240"},
           BadUri{"sim:desk?width=10000000000", "width=10000000000", "whole number"},
           BadUri{"sim:desk?width=100000", "width=100000", "1920"},
           BadUri{"sim:desk?duration=-3", "duration=-3", "0 .."},
           BadUri{"sim:desk?lens=fisheye", "lens=fisheye", "brown_conrady"},
       }) {
    const absl::Status status = SimOptions::FromUri(bad.uri).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad.uri;
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr(bad.names), HasSubstr(bad.remedy)));
  }
}

}  // namespace
}  // namespace saccade::sim_options_test
