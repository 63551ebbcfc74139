#include "server/mount/drivers/drivers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace saccade::drivers_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Refusal(const std::string& uri, const MountFacts& facts) {
  return std::string(MountDrivers().Check(uri, facts).message());
}

TEST(MountDrivers, SayHowTheyAreCalledAndWhichTablesTheyRead) {
  EXPECT_EQ(MountDrivers().Usage(),
            "none | sim[?crooked=SEED] | dynamixel:DEVICE[?baud=N] | v4l2:DEVICE | crop:[WxH]");
  EXPECT_THAT(MountDrivers().Tables(), ElementsAre("mount_model", "dynamixel", "v4l2"));
}

TEST(MountDrivers, RefuseWhatCannotBeBeforeAnythingIsOpened) {
  EXPECT_EQ(Refusal("warp", {"sim:desk"}),
            "--mount: 'warp' is not known: use none, sim, dynamixel:/dev/ttyUSB0, v4l2:/dev/video0 "
            "or crop:");
  EXPECT_EQ(Refusal("sim", {"dataset:/x"}), "--mount: sim turns the camera of a sim: source only");
  EXPECT_EQ(Refusal("dynamixel:", {"sim:desk"}),
            "--mount: dynamixel: names no device: write for example dynamixel:/dev/ttyUSB0");
  EXPECT_EQ(Refusal("v4l2:", {"sim:desk"}),
            "--mount: v4l2: names no device: write for example v4l2:/dev/video0");
  for (const char* uri : {"sim", "sim?crooked=1", "dynamixel:/dev/x", "v4l2:/dev/x"}) {
    EXPECT_EQ(Refusal(uri, {"sim:desk", true}),
              "--mount: a head moves by the clock: leave --speed max out");
    EXPECT_EQ(Refusal(uri, {"sim:desk"}), "");
  }
  EXPECT_EQ(Refusal("crop:", {"dataset:/x", true}), "");
}

TEST(MountDrivers, OpenWhatNeedsNoHardware) {
  MountContext context;
  context.camera.width = 640;
  context.camera.height = 480;
  context.camera.fx = context.camera.fy = 500;
  const absl::StatusOr<OpenedMount> sim = MountDrivers().Open("sim?crooked=1", context);
  ASSERT_TRUE(sim.ok()) << sim.status();
  EXPECT_NE(sim->mount, nullptr);
  EXPECT_NE(sim->head, nullptr);
  const absl::StatusOr<OpenedMount> crop = MountDrivers().Open("crop:", context);
  ASSERT_TRUE(crop.ok()) << crop.status();
  ASSERT_TRUE(crop->crop);
  EXPECT_EQ(crop->crop->width, 320);
  EXPECT_EQ(crop->head, nullptr);
  EXPECT_EQ(std::string(MountDrivers().Open("crop:big", context).status().message()),
            "--mount: crop:big is not crop:WxH, for example crop:480x360");
  EXPECT_EQ(std::string(MountDrivers().Open("sim?bent=1", context).status().message()),
            "--mount: sim?bent=1 is not understood; write for example sim?crooked=1");
}

// The one description of an option is also what is printed: read back, it is the default.
TEST(MountDrivers, WhatDescribesTheTablesIsAFileThatChangesNothing) {
  const std::filesystem::path file = ::testing::TempDir() + "mount_drivers_test.toml";
  const std::string text = MountDrivers().Describe();
  std::ofstream(file) << text;
  for (const char* words : {"[mount_model.pan]", "[dynamixel.cyclotorsion]", "[v4l2]",
                            "order = ", "baud = 57600", "9600 to 4.5e+06: "}) {
    EXPECT_THAT(text, HasSubstr(words));
  }
  MountOptions model;
  ASSERT_TRUE(model.LoadToml(file).ok()) << model.LoadToml(file);
  EXPECT_EQ(ToToml(model), ToToml(MountOptions()));
}

}  // namespace
}  // namespace saccade::drivers_test
