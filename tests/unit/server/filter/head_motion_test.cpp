// Head motion that encoders tell (slam-spec 8): Jacobians, bookkeeping, and what it is for.
#include <gtest/gtest.h>

#include <numbers>

#include "server/filter/filter_state.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::head_motion_test {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
constexpr double kDt = 1.0 / 30.0;

Rigid3 Moved(const Rigid3& pose, const Vector6& error) {
  return {pose.rotation * ExpQuaternion(error.tail<3>()), pose.translation + error.head<3>()};
}

HeadMotion RandomHead(RandomWorld& world) {
  HeadMotion head;
  head.camera_from_next = {ExpQuaternion(world.NormalVector<3>(0.3)), world.NormalVector<3>(0.1)};
  Matrix6d root;
  for (int c = 0; c < 6; ++c) root.col(c) = world.NormalVector<6>();
  head.covariance = root * root.transpose();
  return head;
}

TEST(HeadMotion, JacobiansMatchCentralDifferencesT1) {
  RandomWorld world(5);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 1000; ++k) {
    const CameraMotion camera = world.Motion();
    const HeadMotion head = RandomHead(world);
    const MotionJacobians jacobians = LineariseHead(camera, head);
    const CameraMotion next = TurnHead(camera, head.camera_from_next);
    Matrix12d f;
    for (int c = 0; c < 12; ++c) {
      const Vector12d step = kStep * Vector12d::Unit(c);
      f.col(c) = (Minus(TurnHead(Plus(camera, step), head.camera_from_next), next) -
                  Minus(TurnHead(Plus(camera, -step), head.camera_from_next), next)) /
                 (2 * kStep);
    }
    Eigen::Matrix<double, 12, 6> g;
    for (int c = 0; c < 6; ++c) {
      const Vector6 step = kStep * Vector6::Unit(c);
      g.col(c) = (Minus(TurnHead(camera, Moved(head.camera_from_next, step)), next) -
                  Minus(TurnHead(camera, Moved(head.camera_from_next, -step)), next)) /
                 (2 * kStep);
    }
    ASSERT_LT(RelativeError(jacobians.f, f), 1e-6);
    ASSERT_LT(RelativeError(jacobians.q, Matrix12d(g * head.covariance * g.transpose())), 1e-6);
  }
}

TEST(HeadMotion, IsTheShouldersMotionWithTheJointsOnTop) {
  // A camera on a lever, the shoulder turning on the spot: whatever the joints do, shoulder and
  // camera part by the joints' transform alone.
  RandomWorld world(6);
  const Rigid3 world_from_shoulder = world.Pose();
  const Rigid3 before{world.Rotation(), {0.02, -0.05, 0.08}};
  const Rigid3 after{world.Rotation(), {-0.03, -0.04, 0.07}};
  const Eigen::Vector3d w_shoulder(0.3, -0.2, 0.5);
  const auto camera_of = [&](const Rigid3& shoulder, const Rigid3& joints) {
    CameraMotion camera;
    camera.world_from_camera = shoulder * joints;
    camera.velocity_m_s = shoulder.rotation * w_shoulder.cross(joints.translation);
    camera.angular_velocity_rad_s = joints.rotation.conjugate() * w_shoulder;
    return camera;
  };
  const CameraMotion expected = camera_of(world_from_shoulder, after);
  const CameraMotion turned =
      TurnHead(camera_of(world_from_shoulder, before), before.Inverse() * after);
  EXPECT_LT(Minus(turned, expected).norm(), 1e-12);
}

Matrix12d StartCovariance() {
  Vector12d sigma;
  sigma << Vector6::Constant(0.001), Vector6::Constant(0.05);
  return sigma.cwiseAbs2().asDiagonal();
}

TEST(HeadMotion, AbsentChangesNothing) {
  RandomWorld world(7);
  const CameraMotion start = world.Motion();
  FilterState filter{FilterOptions()};
  filter.Reset(start, StartCovariance());
  CameraMotion camera = start;
  Covariance covariance;
  covariance.Assign(StartCovariance());
  for (int k = 0; k < 5; ++k) {
    const MotionJacobians m1 =
        LineariseMotion(camera, camera.world_from_camera.rotation, kDt, MotionNoise());
    covariance.TransformBlock(0, m1.f);
    covariance.AddBlock(0, m1.q);
    camera = PropagateMotion(camera, kDt);
    filter.Predict(kDt, MotionNoise());
  }
  EXPECT_EQ(Minus(filter.camera(), camera).head<3>(), Eigen::Vector3d::Zero());
  EXPECT_EQ(filter.camera().world_from_camera.rotation.coeffs(),
            camera.world_from_camera.rotation.coeffs());
  EXPECT_EQ(filter.FullCovariance(), covariance.Full());  // to the bit
  EXPECT_EQ(filter.WholeMotion().velocity_m_s, filter.camera().velocity_m_s);
}

/// A pan joint at 344 deg/s, the optic centre 5 cm before its axis.
class FastPan {
 public:
  static constexpr double kRate_rad_s = 344.0 * std::numbers::pi / 180.0;

  static Rigid3 Joints(double t) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(kRate_rad_s * t, Eigen::Vector3d::UnitY()));
    return {turn, turn * Eigen::Vector3d(0, 0, 0.05)};
  }
  static Rigid3 Shoulder(double t) {
    return {ExpQuaternion({0, 0.2 * t, 0.1 * t}), {0.3 * t, 0, 0.1 * t}};
  }
  static Rigid3 Camera(double t) { return Shoulder(t) * Joints(t); }
  static HeadMotion Head(double t) {
    HeadMotion head;
    head.camera_from_next = Joints(t).Inverse() * Joints(t + kDt);
    return head;
  }
  /// The wearer's part of the camera's motion.
  static CameraMotion Motion(double t) {
    constexpr double kSmall = 1e-6;
    const Rigid3 next = Shoulder(t + kSmall) * Joints(t);
    CameraMotion motion;
    motion.world_from_camera = Camera(t);
    motion.velocity_m_s = (next.translation - motion.world_from_camera.translation) / kSmall;
    motion.angular_velocity_rad_s =
        LogQuaternion(motion.world_from_camera.rotation.conjugate() * next.rotation) / kSmall;
    return motion;
  }
};

TEST(HeadMotion, FastTurnStaysInsideSmallEllipses) {
  const CameraModel lens = TestCamera();
  constexpr double kNow = 0.2;
  const MotionNoise worn{2.0, 3.0};
  FilterState told{FilterOptions()}, blind{FilterOptions()};
  told.Reset(FastPan::Motion(kNow), StartCovariance());
  blind.Reset(FastPan::Motion(kNow), StartCovariance());
  const HeadMotion head = FastPan::Head(kNow);
  told.Predict(kDt, worn, &head);
  blind.Predict(kDt, worn);
  const Rigid3 truth = FastPan::Camera(kNow + kDt);
  RandomWorld world(8);
  double least_blind = 1e9;
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector2d pixel(world.Uniform(60, 580), world.Uniform(60, 420));
    const Eigen::Vector3d point = truth * (2.0 * *lens.Unproject(pixel));
    const auto predicted = told.Predicted(lens, point);
    ASSERT_TRUE(predicted);
    const Eigen::Vector2d error = predicted->at.pixel - pixel;
    EXPECT_LT(error.norm(), 1.0);
    EXPECT_LT(error.dot(predicted->covariance.inverse() * error), 9.0);
    EXPECT_LT(std::sqrt(predicted->covariance.trace()), 6.0);
    const auto unaided = blind.Predicted(lens, point);
    if (unaided) least_blind = std::min(least_blind, (unaided->at.pixel - pixel).norm());
  }
  EXPECT_GT(least_blind, 60.0);  // one frame is 11.5 degrees
}

TEST(HeadMotion, VelocitiesSurviveEncodersThatComeAndGo) {
  FilterState filter{FilterOptions()};
  filter.Reset(FastPan::Motion(0), StartCovariance());
  HeadMotion head = FastPan::Head(0);
  filter.Predict(kDt, MotionNoise(), &head);
  const auto expect_whole = [&](double t, double tolerance) {
    const Rigid3 now = FastPan::Camera(t), next = FastPan::Camera(t + 1e-6);
    EXPECT_LT((filter.WholeMotion().angular_velocity_rad_s -
               LogQuaternion(now.rotation.conjugate() * next.rotation) / 1e-6)
                  .norm(),
              tolerance);
    EXPECT_LT(
        (filter.WholeMotion().velocity_m_s - (next.translation - now.translation) / 1e-6).norm(),
        tolerance);
  };
  expect_whole(kDt, 0.05);
  EXPECT_LT(filter.camera().angular_velocity_rad_s.norm(), 0.3);
  // Silent: the camera goes on as it did, and its velocities are whole.
  filter.Predict(1e-3, MotionNoise());
  expect_whole(kDt + 1e-3, 0.06);
  EXPECT_EQ(filter.camera().angular_velocity_rad_s, filter.WholeMotion().angular_velocity_rad_s);
  EXPECT_GT(filter.camera().angular_velocity_rad_s.norm(), 5.0);
  // And back: the wearer's alone again.
  head = FastPan::Head(kDt + 1e-3);
  filter.Predict(kDt, MotionNoise(), &head);
  EXPECT_LT(filter.camera().angular_velocity_rad_s.norm(), 0.3);
  EXPECT_LT(RotationAngle(filter.camera().world_from_camera, FastPan::Camera(2 * kDt + 1e-3)),
            2e-3);
}

TEST(HeadMotion, UncertainEncodersWidenTheVelocitiesTheyChange) {
  FilterState filter{FilterOptions()};
  filter.Reset(FastPan::Motion(0), StartCovariance());
  const MotionNoise still{1e-9, 1e-9};
  filter.Predict(kDt, still);
  const Eigen::MatrixXd before = filter.CameraCovariance();
  filter.ResetCamera(FastPan::Motion(0), StartCovariance());
  HeadMotion head = FastPan::Head(0);
  head.covariance = 1e-6 * Matrix6d::Identity();
  filter.Predict(kDt, still, &head);
  const double known = filter.CameraCovariance()(10, 10);
  filter.Predict(kDt, still);  // lost: what is added is known as well as the encoders were
  EXPECT_NEAR(filter.CameraCovariance()(10, 10), known + 1e-6 / (kDt * kDt), 1e-6);
  EXPECT_GT(filter.CameraCovariance()(4, 4), before(4, 4));
}

TEST(HeadMotion, JournalCarriesCorrectionsThroughIt) {
  const MotionNoise noise;
  CameraMotion start = FastPan::Motion(0);
  RandomWorld world(9);
  FilterState late{FilterOptions()}, early{FilterOptions()};
  late.Reset(start, StartCovariance());
  late.SetCheckpoint();
  Vector6 step;
  step = world.NormalVector<6>(1e-4);
  const Rigid3 moved = Moved(start.world_from_camera, step);
  start.velocity_m_s = moved.rotation * (start.world_from_camera.rotation.conjugate() *
                                         start.velocity_m_s);  // as Refine() has it
  start.world_from_camera = moved;
  early.Reset(start, StartCovariance());
  for (int k = 0; k < 5; ++k) {
    const HeadMotion head = FastPan::Head(k * kDt);
    late.Predict(kDt, noise, &head);
    early.Predict(kDt, noise, &head);
  }
  const double apart = Minus(late.camera(), early.camera()).norm();
  Refinement better;
  better.world_from_camera = moved;
  late.Refine(better);
  EXPECT_GT(apart, 1e-4);
  EXPECT_LT(Minus(late.camera(), early.camera()).norm(), 1e-3 * apart);
}

}  // namespace
}  // namespace saccade::head_motion_test
