#include "server/mount/calibration/mount_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <random>

#include "server/mount/calibration/calibration_schedule.hpp"
#include "server/mount/fixed_joint.hpp"
#include "server/mount/mount_model.hpp"
#include "server/mount/mount_options.hpp"

namespace saccade::mount_calibration_test {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

Timestamp Ns(double seconds) { return static_cast<Timestamp>(std::llround(1e9 * seconds)); }

struct World {
  MountOptions truth, believed;
  std::uint64_t seed = 1;
  double picture_noise_deg = 0.1, picture_noise_m = 0.003;
  double encoder_noise_deg = 0.1;
  double false_pictures = 0;  // share of poses that are nonsense
  double base_sway_deg = 0;   // of a wearer who does not stand still
};

/// The head does what the schedule says, the believed model in between, its encoders and the
/// tracker see it, each on its own clock.
CalibrationData Simulate(const World& world) {
  std::mt19937_64 rng(world.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto noise = [&](double sigma) {
    return Eigen::Vector3d(sigma * normal(rng), sigma * normal(rng), sigma * normal(rng));
  };
  const MountModel head(world.truth);
  const CalibrationSchedule schedule(world.believed, {});
  const Rigid3 world_from_mount{ExpQuaternion({0.3, -1.2, 0.5}), {0.4, -1.3, 0.2}};
  const auto truth_at = [&](double t) {
    const Eigen::Vector3d told = schedule.At(t - world.truth.command_latency_s).angles_rad;
    Eigen::Vector3d angles;
    for (int k = 0; k < kMountJoints; ++k) {
      const auto joint = static_cast<MountJoint>(k);
      angles(k) = world.truth.of(joint).FromRaw(world.believed.of(joint).ToRaw(told(k)));
    }
    return ToAngles(angles);
  };
  CalibrationData data;
  for (double t = 0; t < schedule.duration_s() + 1; t += 0.01) {
    data.demands.push_back({Ns(t), schedule.At(t).angles_rad});
    const Eigen::Vector3d angles = ToVector(truth_at(t)) + noise(world.encoder_noise_deg * kDegree);
    EncoderReading reading;
    Eigen::Vector3d read;
    for (int k = 0; k < kMountJoints; ++k) {
      const auto joint = static_cast<MountJoint>(k);
      read(k) = world.believed.of(joint).FromRaw(world.truth.of(joint).ToRaw(angles(k)));
    }
    reading.angles = ToAngles(read);
    reading.time_ns = Ns(t + world.truth.encoder_delay_s - world.believed.encoder_delay_s);
    data.readings.push_back(reading);
  }
  for (double t = 0.013; t < schedule.duration_s(); t += 1.0 / 15) {
    CalibrationData::Picture picture;
    picture.time_ns = Ns(t);
    picture.rotation_sigma_rad = world.picture_noise_deg * kDegree;
    picture.position_sigma_m = world.picture_noise_m;
    Rigid3 base = world_from_mount;
    base.rotation =
        base.rotation * ExpQuaternion({0, world.base_sway_deg * kDegree * std::sin(3 * t), 0});
    picture.world_from_camera = base * head.MountFromCamera(truth_at(t));
    picture.world_from_camera.rotation =
        picture.world_from_camera.rotation * ExpQuaternion(noise(picture.rotation_sigma_rad));
    picture.world_from_camera.translation += noise(world.picture_noise_m);
    if (uniform(rng) < world.false_pictures) {
      picture.world_from_camera.rotation = ExpQuaternion(noise(1.0));
    }
    data.pictures.push_back(picture);
  }
  return data;
}

Eigen::Vector3d Tilted(const Eigen::Vector3d& axis, double x_deg, double y_deg, double z_deg) {
  return ExpSo3(Eigen::Vector3d(x_deg, y_deg, z_deg) * kDegree) * axis;
}

/// Axes tilted by a few degrees, two signs wrong, zeros off, the encoders 35 ms late.
World Crooked() {
  World world;
  MountOptions& truth = world.truth;
  truth.of(MountJoint::kPan).axis = Tilted(Eigen::Vector3d::UnitY(), 3, 0, -2);
  truth.of(MountJoint::kElevation).axis = Tilted(Eigen::Vector3d::UnitX(), 0, 4, 1.5);
  truth.of(MountJoint::kCyclotorsion).axis = Tilted(Eigen::Vector3d::UnitZ(), -2.5, 3, 0);
  truth.of(MountJoint::kPan).offset_m = {0.0, -0.04, 0.01};
  truth.of(MountJoint::kCyclotorsion).offset_m = {0.01, 0.0, 0.06};
  truth.of(MountJoint::kElevation).encoder_sign = -1;
  truth.of(MountJoint::kCyclotorsion).encoder_sign = -1;
  truth.of(MountJoint::kElevation).encoder_zero_rad = 7 * kDegree;
  truth.encoder_delay_s = 0.035;
  truth.command_latency_s = 0.06;
  return world;
}

struct Mismatch {
  double rotation_deg = 0, position_m = 0;
};
/// Worst over pairs of raw angles: by how much two models disagree on how the camera gets from one
/// to the other. What cannot be seen (the base's own frame, pan's zero) does not count.
Mismatch Compare(const MountOptions& a, const MountOptions& b) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> angle(-25 * kDegree, 25 * kDegree);
  const auto pose = [](const MountOptions& options, const Eigen::Vector3d& raw) {
    Eigen::Vector3d angles;
    for (int k = 0; k < kMountJoints; ++k) {
      angles(k) = options.of(static_cast<MountJoint>(k)).FromRaw(raw(k));
    }
    return MountModel(options).MountFromCamera(ToAngles(angles));
  };
  Mismatch worst;
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector3d from(angle(rng), angle(rng), angle(rng)),
        to(angle(rng), angle(rng), angle(rng));
    const Rigid3 by_a = pose(a, from).Inverse() * pose(a, to);
    const Rigid3 by_b = pose(b, from).Inverse() * pose(b, to);
    worst.rotation_deg = std::max(worst.rotation_deg, RotationAngle(by_a, by_b) / kDegree);
    worst.position_m = std::max(worst.position_m, (by_a.translation - by_b.translation).norm());
  }
  return worst;
}

TEST(MountCalibration, RecoversTiltedAxesFlippedSignsZerosAndDelays) {
  for (const std::uint64_t seed : {1, 2}) {
    World world = Crooked();
    world.seed = seed;
    const auto found = CalibrateMount(Simulate(world), world.believed);
    ASSERT_TRUE(found.ok()) << found.status();
    const Mismatch before = Compare(world.believed, world.truth);
    const Mismatch after = Compare(found->mount, world.truth);
    std::printf(
        "seed %d: %.1f deg, %.0f mm off before, %.3f deg, %.1f mm after; delay %.1f +- %.1f ms, "
        "latency %.1f ms; residual %.2f deg before, %.3f after, max %.2f\n",
        static_cast<int>(seed), before.rotation_deg, 1e3 * before.position_m, after.rotation_deg,
        1e3 * after.position_m, 1e3 * found->encoder_delay_s, 1e3 * found->encoder_delay_sigma_s,
        1e3 * found->command_latency_s, found->orientation_rms_before_rad / kDegree,
        found->orientation_rms_rad / kDegree, found->orientation_max_rad / kDegree);
    EXPECT_GT(before.rotation_deg, 20);
    EXPECT_LT(after.rotation_deg, 0.15);
    EXPECT_LT(after.position_m, 0.004);
    EXPECT_NEAR(found->encoder_delay_s, 0.035, 0.001);
    EXPECT_NEAR(found->command_latency_s, 0.06, 0.002);
    // Orientation noise of 0.1 deg on three axes is 0.17; the encoders' is smoothed.
    EXPECT_NEAR(found->orientation_rms_rad, 0.19 * kDegree, 0.02 * kDegree);
    EXPECT_GT(found->orientation_rms_before_rad, 3 * kDegree);
    EXPECT_EQ(found->outliers, 0);
    EXPECT_EQ(found->mount.of(MountJoint::kPan).encoder_sign, 1);
    EXPECT_EQ(found->mount.of(MountJoint::kElevation).encoder_sign, -1);
    EXPECT_EQ(found->mount.of(MountJoint::kCyclotorsion).encoder_sign, -1);
    EXPECT_TRUE(found->joints[1].sign_flipped);
    EXPECT_FALSE(found->joints[0].sign_flipped);
    // What the angle between neighbouring axes is, no zero can change.
    const auto between = [](const MountOptions& mount, MountJoint a, MountJoint b) {
      return std::acos(mount.of(a).axis.dot(mount.of(b).axis)) / kDegree;
    };
    EXPECT_NEAR(between(found->mount, MountJoint::kPan, MountJoint::kElevation),
                between(world.truth, MountJoint::kPan, MountJoint::kElevation), 0.1);
    EXPECT_NEAR(between(found->mount, MountJoint::kElevation, MountJoint::kCyclotorsion),
                between(world.truth, MountJoint::kElevation, MountJoint::kCyclotorsion), 0.1);
    for (const auto& joint : found->joints) {
      EXPECT_LT(joint.axis_sigma_rad, 0.1 * kDegree);
      EXPECT_LT(joint.turned_rad, 6 * kDegree) << "zeros bring the axes near to their names";
    }
  }
}

TEST(MountCalibration, AStraightMountStaysAsItIs) {
  World world;
  const auto found = CalibrateMount(Simulate(world), world.believed);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(Compare(found->mount, world.truth).rotation_deg, 0.1);
  for (const auto& joint : found->joints) {
    EXPECT_LT(joint.turned_rad, 0.1 * kDegree);
    EXPECT_LT(std::abs(joint.zero_shift_rad), 0.1 * kDegree);
  }
  EXPECT_NEAR(found->encoder_delay_s, 0, 0.002);
}

TEST(MountCalibration, ACameraMountedOnItsSideIsUnderstood) {
  World world = Crooked();
  // A quarter turn about the optic axis after the joints: the others' axes seen from the camera.
  const Eigen::Matrix3d side = ExpSo3({0, 0, -90 * kDegree});
  for (JointOptions& joint : world.truth.joints) joint.axis = side * joint.axis;
  const auto found = CalibrateMount(Simulate(world), world.believed);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(Compare(found->mount, world.truth).rotation_deg, 0.15);
  EXPECT_NEAR(std::abs(found->joints[2].zero_shift_rad), 90 * kDegree, 6 * kDegree);
}

TEST(MountCalibration, SurvivesNonsensePosesAndLeavesMotorlessJointsAlone) {
  World world = Crooked();
  world.false_pictures = 0.08;
  FixJoint(world.believed.of(MountJoint::kCyclotorsion));
  JointOptions& torsion = world.truth.of(MountJoint::kCyclotorsion);
  torsion = world.believed.of(MountJoint::kCyclotorsion);
  const auto found = CalibrateMount(Simulate(world), world.believed);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_GT(found->outliers, 30);
  EXPECT_FALSE(found->joints[2].moved);
  EXPECT_EQ(found->mount.of(MountJoint::kCyclotorsion).axis, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(found->joints[2].zero_shift_rad, 0);
  EXPECT_NEAR(found->encoder_delay_s, 0.035, 0.003);
  EXPECT_EQ(found->mount.of(MountJoint::kElevation).encoder_sign, -1);
}

TEST(MountCalibration, WithoutMetresTheOffsetsStay) {
  World world = Crooked();
  CalibrationData data = Simulate(world);
  data.metric = false;
  const auto found = CalibrateMount(data, world.believed);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(Compare(found->mount, world.truth).rotation_deg, 0.15);
  EXPECT_EQ(found->mount.of(MountJoint::kPan).offset_m, Eigen::Vector3d::Zero());
  EXPECT_EQ(found->position_rms_m, 0);
}

TEST(MountCalibration, LimitsStayWhereTheMotorHasThem) {
  World world = Crooked();
  world.believed.of(MountJoint::kElevation).min_rad = -60 * kDegree;
  const auto found = CalibrateMount(Simulate(world), world.believed);
  ASSERT_TRUE(found.ok());
  const JointOptions& before = world.believed.of(MountJoint::kElevation);
  const JointOptions& after = found->mount.of(MountJoint::kElevation);
  ASSERT_TRUE(found->joints[1].sign_flipped);
  EXPECT_NEAR(after.ToRaw(after.max_rad), before.ToRaw(before.min_rad), 1e-9);
  EXPECT_NEAR(after.ToRaw(after.min_rad), before.ToRaw(before.max_rad), 1e-9);
}

TEST(MountCalibration, ABaseThatMovesIsRefusedWithARemedy) {
  World world = Crooked();
  world.base_sway_deg = 6;
  const auto found = CalibrateMount(Simulate(world), world.believed);
  EXPECT_EQ(found.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("keep the mount's base still"));
}

TEST(MountCalibration, TooLittleIsRefusedWithWhatIsMissing) {
  const World world;
  CalibrationData data = Simulate(world);
  data.pictures.resize(50);
  EXPECT_THAT(std::string(CalibrateMount(data, {}).status().message()), HasSubstr("50 pictures"));
  data = Simulate(world);
  data.readings.clear();
  EXPECT_THAT(std::string(CalibrateMount(data, {}).status().message()), HasSubstr("readings"));
  data = Simulate(world);
  for (EncoderReading& reading : data.readings) reading.angles = {};
  EXPECT_THAT(std::string(CalibrateMount(data, {}).status().message()),
              HasSubstr("no joint moved"));
  data = Simulate(world);
  for (EncoderReading& reading : data.readings) reading.time_ns += 3600 * Ns(1);
  EXPECT_THAT(std::string(CalibrateMount(data, {}).status().message()), HasSubstr("clock"));
}

TEST(MountToml, IsReadBackAsItWas) {
  World world = Crooked();
  world.truth.order = {MountJoint::kElevation, MountJoint::kPan, MountJoint::kCyclotorsion};
  const std::filesystem::path file = ::testing::TempDir() + "mount_toml_test.toml";
  std::ofstream(file) << ToToml(world.truth);
  MountOptions read;
  const absl::Status loaded = read.LoadToml(file);
  ASSERT_TRUE(loaded.ok()) << loaded;
  EXPECT_EQ(read.order, world.truth.order);
  EXPECT_NEAR(read.encoder_delay_s, 0.035, 1e-12);
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    EXPECT_TRUE(read.joints[k].axis.isApprox(world.truth.joints[k].axis, 1e-9));
    EXPECT_TRUE(read.joints[k].offset_m.isApprox(world.truth.joints[k].offset_m, 1e-9));
    EXPECT_EQ(read.joints[k].encoder_sign, world.truth.joints[k].encoder_sign);
    EXPECT_NEAR(read.joints[k].encoder_zero_rad, world.truth.joints[k].encoder_zero_rad, 1e-9);
    EXPECT_NEAR(read.joints[k].max_rad, world.truth.joints[k].max_rad, 1e-9);
  }
}

}  // namespace
}  // namespace saccade::mount_calibration_test
