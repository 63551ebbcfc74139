#include "server/filter/inertial_motion.hpp"

#include <algorithm>
#include <cmath>

#include "server/filter/constant_velocity.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

using E = InertialErrors;
using Square = MotionModel::Square;
using Matrix19d = Eigen::Matrix<double, E::kDim, E::kDim>;
using Vector19d = Eigen::Matrix<double, E::kDim, 1>;

constexpr double kLongestHole_s = 0.1;  // between two samples: a hand shakes at up to 5 Hz

/// Where the unit is, and how it moves: what is integrated.
struct UnitState {
  Rigid3 world_from_imu;
  Vector3d velocity;
};

UnitState ToUnit(const CameraMotion& motion) {
  return {motion.world_from_camera * motion.imu.camera_from_imu, motion.velocity_m_s};
}

/// Errors of the unit's position and rotation by those of the camera's.
Matrix19d UnitByCamera(const CameraMotion& motion) {
  const Rigid3& camera_from_imu = motion.imu.camera_from_imu;
  Matrix19d by = Matrix19d::Identity();
  by.block<3, 3>(E::kPosition, E::kRotation) =
      -motion.world_from_camera.RotationMatrix() * Skew(camera_from_imu.translation);
  by.block<3, 3>(E::kRotation, E::kRotation) = camera_from_imu.RotationMatrix().transpose();
  return by;
}

Matrix19d CameraByUnit(const CameraMotion& motion) {
  const Rigid3& camera_from_imu = motion.imu.camera_from_imu;
  const Matrix3d turn = camera_from_imu.RotationMatrix();
  Matrix19d by = Matrix19d::Identity();
  by.block<3, 3>(E::kPosition, E::kRotation) =
      motion.world_from_camera.RotationMatrix() * Skew(camera_from_imu.translation) * turn;
  by.block<3, 3>(E::kRotation, E::kRotation) = turn;
  return by;
}

ImuSample Between(const ImuSample& a, const ImuSample& b, double at_ns) {
  const double share = std::clamp(
      (at_ns - static_cast<double>(a.time_ns)) / static_cast<double>(b.time_ns - a.time_ns), 0.0,
      1.0);
  ImuSample sample = a;
  sample.angular_velocity_rad_s += share * (b.angular_velocity_rad_s - a.angular_velocity_rad_s);
  sample.acceleration_m_s2 += share * (b.acceleration_m_s2 - a.acceleration_m_s2);
  return sample;
}

/// How the unit's errors change in time where its state is `unit`: by the clock alone.
Vector19d Rate(const UnitState& unit, const Vector3d& turn_rate, const Vector3d& force,
               const Vector3d& gravity) {
  Vector19d rate = Vector19d::Zero();
  rate.segment<3>(E::kPosition) = unit.velocity;
  rate.segment<3>(E::kRotation) = turn_rate;
  rate.segment<3>(E::kVelocity) = unit.world_from_imu.rotation * force + gravity;
  return rate;
}

/// One short step with constant turn rate and specific force; F and Q are multiplied on.
void Integrate(const Vector3d& turn_rate, const Vector3d& force, const Vector3d& gravity, double dt,
               const ImuNoise& noise, UnitState& unit, Matrix19d& f, Matrix19d& q) {
  const Vector3d angle = dt * turn_rate;
  const Quaterniond before = unit.world_from_imu.rotation;
  const Matrix3d middle = (before * ExpQuaternion(0.5 * angle)).toRotationMatrix();
  const Vector3d acceleration = middle * force + gravity;
  Matrix19d step = Matrix19d::Identity();
  // d acceleration / d rotation, there and where the step begins.
  const Matrix3d tilt = -middle * Skew(force);
  const Matrix3d tilt_before = tilt * ExpQuaternion(-0.5 * angle).toRotationMatrix();
  step.block<3, 3>(E::kPosition, E::kRotation) = 0.5 * dt * dt * tilt_before;
  step.block<3, 3>(E::kPosition, E::kVelocity) = dt * Matrix3d::Identity();
  step.block<3, 3>(E::kPosition, E::kAccelerometerBias) = -0.5 * dt * dt * middle;
  step.block<3, 3>(E::kPosition, E::kGravity) = 0.5 * dt * dt * Matrix3d::Identity();
  step.block<3, 3>(E::kRotation, E::kRotation) = ExpQuaternion(-angle).toRotationMatrix();
  step.block<3, 3>(E::kRotation, E::kGyroBias) = -dt * RightJacobianSo3(angle);
  step.block<3, 3>(E::kVelocity, E::kRotation) = dt * tilt_before;
  step.block<3, 3>(E::kVelocity, E::kGyroBias) = -0.5 * dt * dt * tilt;
  step.block<3, 3>(E::kVelocity, E::kAccelerometerBias) = -dt * middle;
  step.block<3, 3>(E::kVelocity, E::kGravity) = dt * Matrix3d::Identity();
  f = step * f;
  q = (step * q * step.transpose()).eval();
  const auto white = [&](int offset, double density) {
    q.diagonal().segment<3>(offset).array() += density * density * dt;
  };
  white(E::kRotation, noise.gyro_rad_s_rt_hz);
  white(E::kVelocity, noise.accelerometer_m_s2_rt_hz);
  white(E::kGyroBias, noise.gyro_walk_rad_s2_rt_hz);
  white(E::kAccelerometerBias, noise.accelerometer_walk_m_s3_rt_hz);
  unit.world_from_imu.translation += dt * unit.velocity + 0.5 * dt * dt * acceleration;
  unit.world_from_imu.rotation = (before * ExpQuaternion(angle)).normalized();
  unit.velocity += dt * acceleration;
}

class InertialModel final : public MotionModel {
 public:
  InertialModel() : MotionModel(E::kDim, E::kVelocity, E::kGyroBias) {}

  CameraMotion Plus(const CameraMotion& motion, const Errors& error) const override {
    Vector12d common = Vector12d::Zero();
    common.head<E::kGyroBias>() = error.head<E::kGyroBias>();
    CameraMotion moved = saccade::Plus(motion, common);
    const Vector3d turned = error.segment<3>(E::kGyroBias);
    moved.imu.gyro_bias_rad_s += turned;
    moved.angular_velocity_rad_s -= motion.imu.camera_from_imu.rotation * turned;
    moved.imu.accelerometer_bias_m_s2 += error.segment<3>(E::kAccelerometerBias);
    moved.imu.gravity_m_s2 += error.segment<3>(E::kGravity);
    moved.imu.offset_s += error[E::kOffset];
    return moved;
  }
  Errors Minus(const CameraMotion& to, const CameraMotion& from) const override {
    Errors error = Errors::Zero(dim());
    error.head<E::kGyroBias>() = saccade::Minus(to, from).head<E::kGyroBias>();
    error.segment<3>(E::kGyroBias) = to.imu.gyro_bias_rad_s - from.imu.gyro_bias_rad_s;
    error.segment<3>(E::kAccelerometerBias) =
        to.imu.accelerometer_bias_m_s2 - from.imu.accelerometer_bias_m_s2;
    error.segment<3>(E::kGravity) = to.imu.gravity_m_s2 - from.imu.gravity_m_s2;
    error[E::kOffset] = to.imu.offset_s - from.imu.offset_s;
    return error;
  }
  Step Predict(const CameraMotion& motion, const Quaterniond& first_rotation, double dt,
               const MotionNoise& noise) const override {
    const MotionJacobians by = LineariseMotion(motion, first_rotation, dt, noise);
    Step step{PropagateMotion(motion, dt), Square::Identity(dim(), dim()),
              Square::Zero(dim(), dim())};
    step.f.topLeftCorner<E::kGyroBias, E::kGyroBias>() =
        by.f.topLeftCorner<E::kGyroBias, E::kGyroBias>();
    step.q.topLeftCorner<E::kGyroBias, E::kGyroBias>() =
        by.q.topLeftCorner<E::kGyroBias, E::kGyroBias>();
    // The turn rate is not in the state: what it changes by within the step adds to the rotation.
    const double turned = dt * noise.angular_acceleration_rad_s2;
    step.q.diagonal().segment<3>(E::kRotation).array() += dt * dt * turned * turned;
    return step;
  }
  Step Turn(const CameraMotion& motion, const HeadMotion& head) const override {
    Step step{TurnHead(motion, head.camera_from_next), Square::Identity(dim(), dim()),
              Square::Zero(dim(), dim())};
    const MotionJacobians by = LineariseHead(motion, head);
    step.f.topLeftCorner<6, 6>() = by.f.topLeftCorner<6, 6>();
    step.q.topLeftCorner<6, 6>() = by.q.topLeftCorner<6, 6>();
    return step;
  }
  Errors OfScale(const Errors& error) const override {
    Errors lengths = Errors::Zero(dim());
    lengths.segment<3>(E::kPosition) = error.segment<3>(E::kPosition);
    lengths.segment<3>(E::kVelocity) = error.segment<3>(E::kVelocity);
    return lengths;
  }
  void ByOrigin(const CameraMotion& motion, const Rigid3& origin,
                Eigen::Ref<Eigen::MatrixXd> rows) const override {
    const Matrix3d turn = origin.rotation.toRotationMatrix();
    PoseByOrigin(motion.world_from_camera, origin, rows.topRows<6>());
    rows.block<3, 3>(E::kVelocity, 3) = -Skew(motion.velocity_m_s) * turn;
    rows.block<3, 3>(E::kGravity, 3) = -Skew(motion.imu.gravity_m_s2) * turn;
  }
  Square InMovedWorld(const Matrix3d& turn) const override {
    Square by = Square::Identity(dim(), dim());
    for (const int offset : {E::kPosition, E::kVelocity}) by.block<3, 3>(offset, offset) = turn;
    // Gravity is in metres whatever the map's unit was thought to be.
    by.block<3, 3>(E::kGravity, E::kGravity) = turn / std::cbrt(turn.determinant());
    return by;
  }
};

}  // namespace

const MotionModel& InertialMotion() {
  static const InertialModel model;
  return model;
}

bool Covers(const ImuStep& step, double offset_s) {
  const auto offset_ns = static_cast<Timestamp>(std::llround(1e9 * offset_s));
  const Timestamp from = step.from_ns + offset_ns, to = step.to_ns + offset_ns;
  constexpr auto kHole_ns = static_cast<Timestamp>(1e9 * kLongestHole_s);
  auto at = std::ranges::upper_bound(step.samples, from, {}, &ImuSample::time_ns);
  if (at == step.samples.begin()) return false;
  for (--at; at->time_ns < to; ++at) {
    const auto next = std::next(at);
    if (next == step.samples.end() || next->time_ns - at->time_ns > kHole_ns) return false;
  }
  return to > from;
}

MotionModel::Step PropagateInertial(const CameraMotion& motion, const ImuStep& step) {
  const ImuState& imu = motion.imu;
  const double from = static_cast<double>(step.from_ns - step.samples.front().time_ns);
  const double to = static_cast<double>(step.to_ns - step.samples.front().time_ns);
  const double offset_ns = 1e9 * imu.offset_s;
  const auto origin = static_cast<double>(step.samples.front().time_ns);
  UnitState unit = ToUnit(motion);
  Matrix19d f = Matrix19d::Identity(), q = Matrix19d::Zero();
  Vector19d rate_before = Vector19d::Zero();
  Vector3d turn_rate = Vector3d::Zero(), force = Vector3d::Zero();
  const auto corrected = [&](const ImuSample& sample) {
    turn_rate = sample.angular_velocity_rad_s - imu.gyro_bias_rad_s;
    force = sample.acceleration_m_s2 - imu.accelerometer_bias_m_s2;
  };
  bool first = true;
  const double begin = from + offset_ns, end = to + offset_ns;
  auto next = std::ranges::upper_bound(step.samples, step.from_ns + std::llround(offset_ns), {},
                                       &ImuSample::time_ns);
  for (double now = begin; now < end && next != step.samples.end(); ++next) {
    const ImuSample& a = *std::prev(next);
    const double until = std::min(end, static_cast<double>(next->time_ns) - origin);
    if (until <= now) continue;
    if (first) {
      corrected(Between(a, *next, now + origin));
      rate_before = Rate(unit, turn_rate, force, imu.gravity_m_s2);
      first = false;
    }
    corrected(Between(a, *next, 0.5 * (now + until) + origin));
    Integrate(turn_rate, force, imu.gravity_m_s2, 1e-9 * (until - now), step.noise, unit, f, q);
    corrected(Between(a, *next, until + origin));
    now = until;
  }
  // A clock that is ahead by more has both ends of the step later.
  f.col(E::kOffset) += Rate(unit, turn_rate, force, imu.gravity_m_s2) - f * rate_before;
  CameraMotion after = motion;
  after.world_from_camera = unit.world_from_imu * imu.camera_from_imu.Inverse();
  after.velocity_m_s = unit.velocity;
  after.angular_velocity_rad_s = imu.camera_from_imu.rotation * turn_rate;
  const Matrix19d back = CameraByUnit(after);
  return {after, back * f * UnitByCamera(motion), back * q * back.transpose()};
}

}  // namespace saccade
