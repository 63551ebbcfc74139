#include "shared/wire/gaze.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace saccade::wire::gaze_test {
namespace {

using ::testing::StartsWith;

GazeSnapshot Full() {
  GazeSnapshot state;
  state.mode = GazeMode::kFixate;
  state.time_ns = 123;
  state.joints_rad = {0.5, -0.2, 0.1};
  state.target = GazeFeature{17};
  state.target_in_world = {1, 2, 3};
  state.error_rad = 0.01;
  state.arrived = true;
  state.target_lost = true;
  state.reachable = false;
  state.miss_rad = 0.3;
  state.fast = true;
  state.problem = "mount: pan does not follow: free the joint";
  state.pilot = GazePilot{"s1", "Ann"};
  state.queue = {{"s2", "Bob"}, {"s3", "Cleo"}};
  state.paused = true;
  state.handovers = 4;
  state.last_handover = "Bob released; Ann pilots";
  state.guidance_rad = 1.5;
  return state;
}

TEST(GazeWire, AStateComesBackAsItWas) {
  const v1::GazeState message = ToProto(Full());
  EXPECT_EQ(message.mode(), v1::GAZE_MODE_FIXATE);
  const absl::StatusOr<GazeSnapshot> back = FromProto(message, "state");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(ToProto(*back).SerializeAsString(), message.SerializeAsString());
  EXPECT_EQ(std::get<GazeFeature>(*back->target).id, 17u);
  EXPECT_EQ(back->queue[1].display_name, "Cleo");
}

TEST(GazeWire, EveryModeHasItsName) {
  for (int mode = 0; mode <= static_cast<int>(GazeMode::kParked); ++mode) {
    GazeSnapshot state;
    state.mode = static_cast<GazeMode>(mode);
    const absl::StatusOr<GazeSnapshot> back = FromProto(ToProto(state), "state");
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(back->mode, state.mode);
  }
}

TEST(GazeWire, BadTargetsNameTheField) {
  v1::GazeTarget target;
  EXPECT_THAT(std::string(FromProto(target, "target").status().message()), StartsWith("target: "));
  target.mutable_point_in_world_m()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(std::string(FromProto(target, "target").status().message()),
              StartsWith("target.point_in_world_m"));
  target.set_annotation_id("mug");
  EXPECT_THAT(std::string(FromProto(target, "target").status().message()),
              StartsWith("target.annotation_id"));
}

TEST(GazeWire, BadStatesNameTheField) {
  v1::GazeState state = ToProto(Full());
  state.set_error_rad(std::numeric_limits<double>::infinity());
  EXPECT_THAT(std::string(FromProto(state, "state").status().message()),
              StartsWith("state.error_rad"));
  state = ToProto(Full());
  state.clear_mode();
  EXPECT_THAT(std::string(FromProto(state, "state").status().message()), StartsWith("state.mode"));
}

TEST(WireGaze, ACalibrationComesBackAsItWas) {
  MountCalibrationReport report;
  report.running = false;
  report.share = 1;
  report.problem = "p";
  report.toml = "[mount_model]\n";
  report.joints = {{.name = "pan",
                    .moved = true,
                    .range_rad = 1,
                    .turned_rad = 0.05,
                    .axis_sigma_rad = 0.001,
                    .sign_flipped = true,
                    .zero_shift_rad = -0.1}};
  report.orientation_rms_before_rad = 0.4;
  report.orientation_rms_rad = 0.003;
  report.orientation_max_rad = 0.01;
  report.position_rms_m = 0.002;
  report.encoder_delay_s = 0.035;
  report.command_latency_s = 0.06;
  report.pictures = 1400;
  report.outliers = 3;
  const auto back = wire::FromProto(wire::ToProto(report), "calibration");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(wire::ToProto(*back).SerializeAsString(), wire::ToProto(report).SerializeAsString());
  EXPECT_EQ(back->joints[0].zero_shift_rad, -0.1);
  EXPECT_TRUE(back->joints[0].sign_flipped);
  EXPECT_EQ(back->toml, "[mount_model]\n");
  EXPECT_EQ(back->pictures, 1400);
  v1::MountCalibration bad = wire::ToProto(report);
  bad.set_encoder_delay_s(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(wire::FromProto(bad, "calibration").status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace saccade::wire::gaze_test
