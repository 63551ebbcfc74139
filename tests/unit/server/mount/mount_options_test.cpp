#include "server/mount/mount_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace saccade::mount_options_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

absl::Status Load(const std::string& text, MountOptions& options) {
  const std::filesystem::path file = ::testing::TempDir() + "mount_options_test.toml";
  std::ofstream(file) << text;
  return options.LoadToml(file);
}

TEST(MountOptions, DefaultsAreValid) { EXPECT_TRUE(MountOptions().Validate().ok()); }

TEST(MountOptions, ReadsOrderOffsetsLimitsAndEncoders) {
  MountOptions options;
  const absl::Status loaded = Load(R"(mount = "sim"
[mount_model]
order = ["elevation", "pan", "cyclotorsion"]
encoder_sigma_deg = 0.05
command_latency_ms = 35
[mount_model.pan]
axis = [0, 2, 0]
offset_m = [0.0, -0.05, 0.01]
min_deg = -90
max_deg = 120.5
max_rate_deg_s = 300
encoder_sign = -1
encoder_zero_deg = 180
)",
                                   options);
  ASSERT_TRUE(loaded.ok()) << loaded;
  EXPECT_EQ(options.order[0], MountJoint::kElevation);
  EXPECT_NEAR(options.of(MountJoint::kPan).max_rad, 120.5 * std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(options.of(MountJoint::kPan).axis.y(), 1.0);  // made a unit vector
  EXPECT_EQ(options.of(MountJoint::kPan).offset_m.z(), 0.01);
  EXPECT_EQ(options.of(MountJoint::kPan).encoder_sign, -1);
  EXPECT_NEAR(options.command_latency_s, 0.035, 1e-12);
}

TEST(MountOptions, AFileWithoutATableChangesNothing) {
  MountOptions options;
  EXPECT_TRUE(Load("seed = 3\n", options).ok());
  EXPECT_TRUE(options.Validate().ok());
}

TEST(MountOptions, ErrorsNameFileFieldAndRemedy) {
  const struct {
    const char* text;
    const char* field;
    const char* remedy;
  } kCases[] = {
      {"[mount_model]\nordre = 1\n", "mount_model.ordre", "known: order"},
      {"[mount_model]\norder = [\"pan\", \"pan\", \"elevation\"]\n", "mount_model.order",
       "each once"},
      {"[mount_model]\norder = [\"yaw\", \"pan\", \"elevation\"]\n", "mount_model.order",
       "each once"},
      {"[mount_model.pan]\nmin_deg = 10\nmax_deg = 5\n", "mount_model.pan.min_deg", "less than"},
      {"[mount_model.elevation]\nmax_rate_deg_s = 0\n", "mount_model.elevation.max_rate_deg_s",
       "from 1 to 3600"},
      {"[mount_model.pan]\nmax_deg = \"far\"\n", "mount_model.pan.max_deg", "not a number"},
      {"[mount_model.pan]\nmax_deg = nan\n", "mount_model.pan.m", "give"},
      {"[mount_model.pan]\naxis = [0, 0, 0]\n", "mount_model.pan.axis", "unit vector"},
      {"[mount_model.pan]\noffset_m = [5]\n", "mount_model.pan.offset_m", "three numbers"},
      {"[mount_model.cyclotorsion]\nencoder_sign = 2\n", "mount_model.cyclotorsion.encoder_sign",
       "1 or -1"},
      {"mount_model = 3\n", "mount_model", "not a table"},
      {"[mount_model\n", "mount_options_test.toml", ""},
  };
  for (const auto& each : kCases) {
    MountOptions options;
    const absl::Status status = Load(each.text, options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << each.text;
    EXPECT_THAT(
        std::string(status.message()),
        AllOf(HasSubstr("mount_options_test.toml"), HasSubstr(each.field), HasSubstr(each.remedy)));
    EXPECT_TRUE(options.Validate().ok()) << "a refused file must change nothing";
  }
  EXPECT_EQ(MountOptions().LoadToml("/nowhere.toml").code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace saccade::mount_options_test
