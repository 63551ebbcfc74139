#include <gtest/gtest.h>

#include "server/filter/filter_state.hpp"
#include "tests/unit/server/filter/simulated_unit.hpp"

namespace saccade::inertial_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using E = InertialErrors;

constexpr double kFrame_s = 1.0 / 30.0;

ImuState TrueState(const SimulatedUnit& unit, double offset_s) {
  return {unit.gyro_bias(), unit.accelerometer_bias(), SimulatedUnit::Gravity(), offset_s,
          unit.info().camera_from_imu};
}

CameraMotion TrueMotion(const SimulatedUnit& unit, double t, double offset_s) {
  CameraMotion motion;
  motion.world_from_camera = unit.WorldFromCamera(t);
  motion.velocity_m_s = unit.UnitVelocity(t);
  motion.imu = TrueState(unit, offset_s);
  return motion;
}

TEST(InertialMotion, CarriesTheCameraWhereItWent) {
  SimulatedUnit unit(1);
  const ImuTrack samples = unit.Samples(2.0, 0.004);
  const ImuStep step{samples, SimulatedUnit::ToNs(0.3), SimulatedUnit::ToNs(1.3),
                     unit.info().noise};
  ASSERT_TRUE(Covers(step, 0.004));
  const auto by = PropagateInertial(TrueMotion(unit, 0.3, 0.004), step);
  const VectorXd error = InertialMotion().Minus(by.next, TrueMotion(unit, 1.3, 0.004));
  EXPECT_LT(error.segment<3>(E::kPosition).norm(), 0.01);
  EXPECT_LT(error.segment<3>(E::kRotation).norm(), 0.003);
  // Within what the noise says: 9 degrees of freedom.
  const Eigen::MatrixXd q = by.q.topLeftCorner<9, 9>();
  const VectorXd head = error.head<9>();
  EXPECT_LT(head.dot(q.ldlt().solve(head)), 27.9);
}

TEST(InertialMotion, JacobiansAreThoseOfDifferencesT1) {
  SimulatedUnit unit(2);
  const ImuTrack samples = unit.Samples(1.0, 0.0);
  const ImuStep step{samples, SimulatedUnit::ToNs(0.2021), SimulatedUnit::ToNs(0.2477),
                     unit.info().noise};
  const CameraMotion from = TrueMotion(unit, 0.2021, 0.0);
  const auto by = PropagateInertial(from, step);
  for (int k = 0; k < E::kDim; ++k) {
    const double size = k == E::kOffset ? 2e-4 : 1e-5;
    MotionModel::Errors error = MotionModel::Errors::Zero(E::kDim);
    error[k] = size;
    const auto plus = PropagateInertial(InertialMotion().Plus(from, error), step).next;
    error[k] = -size;
    const auto minus = PropagateInertial(InertialMotion().Plus(from, error), step).next;
    const VectorXd numeric =
        (InertialMotion().Minus(plus, by.next) - InertialMotion().Minus(minus, by.next)) /
        (2.0 * size);
    // Samples are joined by lines: what a shift of time does is as good as these.
    const double tolerance = k == E::kOffset ? 0.3 : 2e-4;
    EXPECT_LT((numeric - by.f.col(k)).norm(), tolerance * std::max(1.0, by.f.col(k).norm()))
        << "error " << k << "\n"
        << numeric.transpose() << "\n"
        << by.f.col(k).transpose();
  }
}

TEST(InertialMotion, DoesNotReachOverHoles) {
  SimulatedUnit unit(3);
  ImuTrack samples = unit.Samples(1.0, 0.0);
  ImuStep step{samples, SimulatedUnit::ToNs(0.2), SimulatedUnit::ToNs(0.8), unit.info().noise};
  EXPECT_TRUE(Covers(step, 0.0));
  EXPECT_FALSE(Covers(step, 0.5)) << "clock offset beyond the end";
  std::erase_if(samples, [](const ImuSample& sample) {
    return sample.time_ns > SimulatedUnit::ToNs(0.4) && sample.time_ns < SimulatedUnit::ToNs(0.55);
  });
  step.samples = samples;
  EXPECT_FALSE(Covers(step, 0.0));
}

TEST(InertialStart, FindsMetreGravityBiasesAndClockWithinItsSigmas) {
  constexpr double kUnit_m = 4.0, kOffset_s = 0.006;
  constexpr int kRuns = 8;
  double nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    SimulatedUnit unit(10 + run);
    const ImuTrack samples = unit.Samples(3.0, kOffset_s);
    const Rigid3 elsewhere = unit.world().Pose();
    std::vector<SeenPose> poses;
    for (double t = 0.3; t < 2.8; t += 0.15) {
      SeenPose pose{SimulatedUnit::ToNs(t), unit.WorldFromCamera(t), 5e-4, 5e-4};
      pose.world_from_camera.translation /= kUnit_m;
      pose.world_from_camera.translation += unit.world().NormalVector<3>(pose.position_sigma);
      pose.world_from_camera.rotation *=
          ExpQuaternion(unit.world().NormalVector<3>(pose.rotation_sigma_rad));
      pose.world_from_camera = elsewhere * pose.world_from_camera;
      poses.push_back(pose);
    }
    const auto found = SolveInertialStart(poses, samples, unit.info(), InertialStartOptions());
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->metres_per_unit / kUnit_m, 1.0, 0.02);
    const Vector3d gravity = elsewhere.rotation * SimulatedUnit::Gravity();
    EXPECT_LT(std::acos(gravity.normalized().dot(found->motion.imu.gravity_m_s2.normalized())),
              0.017);
    EXPECT_LT((found->motion.imu.gyro_bias_rad_s - unit.gyro_bias()).norm(), 0.003);
    EXPECT_NEAR(found->motion.imu.offset_s, kOffset_s, 0.002);
    VectorXd error(8);
    error << std::log(found->metres_per_unit / kUnit_m),
        found->motion.imu.gyro_bias_rad_s - unit.gyro_bias(),
        found->motion.imu.accelerometer_bias_m_s2 - unit.accelerometer_bias(),
        found->motion.imu.offset_s - kOffset_s;
    const std::vector<int> rows = {0, 10, 11, 12, 13, 14, 15, 19};
    const Eigen::MatrixXd p = found->covariance(rows, rows);
    nees += error.dot(p.ldlt().solve(error));
    EXPECT_LT(found->misfit, 1.6);
  }
  EXPECT_GT(nees / kRuns, 5.2);  // chi2(64) / 8, 95 %: 5.5 to 11.0
  EXPECT_LT(nees / kRuns, 11.0);
}

TEST(InertialStart, ACameraWithoutAccelerationTellsNoMetre) {
  SimulatedUnit unit(4);
  ImuTrack samples = unit.Samples(3.0, 0.0);
  for (ImuSample& sample : samples) {
    sample.angular_velocity_rad_s.setZero();
    sample.acceleration_m_s2 = -SimulatedUnit::Gravity();
  }
  std::vector<SeenPose> poses;
  for (double t = 0.3; t < 2.8; t += 0.15) {
    poses.push_back(
        {SimulatedUnit::ToNs(t), {Eigen::Quaterniond::Identity(), {t, 0, 0}}, 1e-3, 1e-3});
  }
  const auto found = SolveInertialStart(poses, samples, unit.info(), InertialStartOptions());
  EXPECT_TRUE(!found || found->scale_sigma > 0.2) << found->scale_sigma;
}

/// Follows a simulated unit among points whose places are known; z - h by the filter's own camera.
struct Followed {
  FilterState filter{FilterOptions()};
  double nees_biases = 0.0;  // mean over the last half
};
Followed Follow(SimulatedUnit& unit, double seconds, double offset_s) {
  constexpr int kPoints = 30;
  constexpr double kPixel_px = 0.5;
  Followed run;
  const CameraModel camera = TestCamera();
  RandomWorld& world = unit.world();
  const ImuTrack samples = unit.Samples(seconds, offset_s);
  std::vector<Vector3d> points;
  for (int k = 0; k < kPoints; ++k) {
    points.push_back({world.Uniform(-1.5, 1.5), world.Uniform(-1.2, 1.2), world.Uniform(1.5, 4)});
  }
  InertialSolution start;
  VectorXd sigma = VectorXd::Zero(E::kDim);
  sigma.segment<3>(E::kPosition).setConstant(0.01);
  sigma.segment<3>(E::kRotation).setConstant(0.01);
  sigma.segment<3>(E::kVelocity).setConstant(0.1);
  sigma.segment<3>(E::kGyroBias).setConstant(0.02);
  sigma.segment<3>(E::kAccelerometerBias).setConstant(0.05);
  sigma.segment<3>(E::kGravity).setConstant(0.1);
  sigma[E::kOffset] = 0.01;
  MotionModel::Errors off(E::kDim);
  for (int k = 0; k < E::kDim; ++k) off[k] = world.Normal(sigma[k]);
  CameraMotion at = TrueMotion(unit, 0.0, offset_s);
  at = InertialMotion().Plus(at, off);
  at.imu.offset_s = 0.0;  // as who does not know
  Matrix12d pose = Matrix12d::Zero();
  pose.diagonal().head<6>() = sigma.head<6>().cwiseAbs2();
  run.filter.Reset(at, pose);
  start.motion = at;
  start.covariance.setZero();
  start.covariance.diagonal().tail<E::kDim>() = sigma.cwiseAbs2();
  run.filter.StartInertial(start, Vector3d::Zero());
  int counted = 0;
  const int frames = static_cast<int>(seconds / kFrame_s);
  for (int frame = 1; frame < frames; ++frame) {
    const double t = frame * kFrame_s;
    const ImuStep step{samples, SimulatedUnit::ToNs(t - kFrame_s), SimulatedUnit::ToNs(t),
                       unit.info().noise};
    EXPECT_TRUE(run.filter.PredictInertial(step, MotionNoise()));
    const Rigid3 camera_from_world = unit.WorldFromCamera(t).Inverse();
    std::vector<Observation> seen;
    for (const Vector3d& point : points) {
      const Vector3d in_camera = camera_from_world * point;
      const auto pixel = in_camera.z() > 0.1 ? camera.Project(in_camera) : std::nullopt;
      if (!pixel || !camera.InImage(*pixel, 10.0)) continue;
      Observation each;
      each.known_point = point;
      each.pixel = *pixel + world.NormalVector<2>(kPixel_px);
      each.noise = kPixel_px * kPixel_px * Eigen::Matrix2d::Identity();
      seen.push_back(each);
    }
    EXPECT_TRUE(run.filter.Update(camera, seen, run.filter.camera().world_from_camera).ok());
    if (2 * frame < frames || frame % 10 != 0) continue;
    const ImuState& imu = run.filter.camera().imu;
    VectorXd error(6);
    error << imu.gyro_bias_rad_s - unit.gyro_bias(),
        imu.accelerometer_bias_m_s2 - unit.accelerometer_bias();
    const Eigen::MatrixXd p =
        run.filter.InertialCovariance().block<6, 6>(E::kGyroBias, E::kGyroBias);
    run.nees_biases += error.dot(p.ldlt().solve(error));
    ++counted;
  }
  run.nees_biases /= counted;
  return run;
}

TEST(InertialFilter, FindsTenMillisecondsOfClockAndItsBiasesAsItSays) {
  constexpr double kOffset_s = 0.01;
  constexpr int kRuns = 6;
  double nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    SimulatedUnit unit(40 + run);
    const Followed followed = Follow(unit, 4.0, kOffset_s);
    EXPECT_NEAR(followed.filter.camera().imu.offset_s, kOffset_s, 0.001);
    EXPECT_LT((followed.filter.camera().imu.gyro_bias_rad_s - unit.gyro_bias()).norm(), 0.003);
    nees += followed.nees_biases / kRuns;
  }
  EXPECT_GT(nees, 3.3);  // chi2(36) / 6, 95 %: 3.6 to 9.1; frames of a run are much alike
  EXPECT_LT(nees, 9.1);
}

TEST(InertialFilter, CarriesTheCameraThroughThreeBlindSeconds) {
  SimulatedUnit unit(60);
  Followed followed = Follow(unit, 5.0, 0.0);
  SimulatedUnit same(60);
  // The same motion goes on.
  const ImuTrack samples = same.Samples(9.0, 0.0);
  const int last = static_cast<int>(5.0 / kFrame_s) - 1;
  for (int frame = last + 1; frame < last + 90; ++frame) {
    const double t = frame * kFrame_s;
    followed.filter.PredictInertial(
        {samples, SimulatedUnit::ToNs(t - kFrame_s), SimulatedUnit::ToNs(t), unit.info().noise},
        MotionNoise());
  }
  const Rigid3 truth = unit.WorldFromCamera((last + 89) * kFrame_s);
  const Vector3d error = followed.filter.camera().world_from_camera.translation - truth.translation;
  EXPECT_LT(error.norm(), 0.10);
  const Eigen::Matrix3d p = followed.filter.PoseCovariance().topLeftCorner<3, 3>();
  EXPECT_LT(error.dot(p.ldlt().solve(error)), 16.3);  // chi2(3), 99.9 %
}

TEST(InertialFilter, AMovedWorldIsTheSameState) {
  SimulatedUnit unit(70);
  const Followed followed = Follow(unit, 1.0, 0.0);
  FilterState moved = followed.filter;
  const Similarity3 by{1.0, unit.world().Rotation(), {1.0, -2.0, 0.5}};
  moved.MoveWorld(by);
  const CameraMotion& before = followed.filter.camera();
  EXPECT_LT((moved.camera().imu.gravity_m_s2 - by.rotation * before.imu.gravity_m_s2).norm(),
            1e-12);
  EXPECT_LT((moved.camera().velocity_m_s - by.rotation * before.velocity_m_s).norm(), 1e-12);
  const auto sigma = [](const FilterState& filter, int offset) {
    return filter.InertialCovariance().block<3, 3>(offset, offset).trace();
  };
  for (const int offset : {E::kPosition, E::kVelocity, E::kGravity, E::kGyroBias}) {
    EXPECT_NEAR(sigma(moved, offset) / sigma(followed.filter, offset), 1.0, 1e-9);
  }
}

TEST(InertialFilter, ACameraThatIsFoundAgainKeepsItsBiases) {
  SimulatedUnit unit(80);
  Followed followed = Follow(unit, 2.0, 0.0);
  const ImuState before = followed.filter.camera().imu;
  const Eigen::MatrixXd p = followed.filter.InertialCovariance();
  CameraMotion elsewhere;
  elsewhere.world_from_camera.translation = {3.0, 0.0, 0.0};
  followed.filter.ResetCamera(elsewhere, Matrix12d::Identity());
  EXPECT_TRUE(followed.filter.inertial());
  EXPECT_EQ(followed.filter.camera().imu.gyro_bias_rad_s, before.gyro_bias_rad_s);
  const Eigen::MatrixXd after = followed.filter.InertialCovariance();
  EXPECT_EQ((after.bottomRightCorner<10, 10>()), (p.bottomRightCorner<10, 10>()));
  EXPECT_EQ((after.bottomLeftCorner<10, 9>()).norm(), 0.0);
}

}  // namespace
}  // namespace saccade::inertial_test
