#include "server/filter/koller_motion.hpp"

#include <array>
#include <cmath>

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kSmall_rad = 0.2;
constexpr int kTerms = 5;

/// c_n(s) = sum (-s)^k / (2 k + n)!, n = 1 .. 4, and its derivatives by s; s is the angle squared.
struct Coefficients {
  std::array<double, 5> c{}, d{};
};

Coefficients Series(double s) {
  Coefficients all;
  for (int n = 1; n <= 4; ++n) {
    double factorial = 1.0;
    for (int k = 2; k <= n; ++k) factorial *= k;
    double power = 1.0, before = 0.0;
    for (int k = 0; k <= kTerms; ++k) {
      if (k > 0) factorial *= (2 * k + n - 1) * (2 * k + n);
      all.c[n] += power / factorial;
      if (k > 0) all.d[n] -= k * before / factorial;
      before = power;
      power *= -s;
    }
  }
  return all;
}

Coefficients ClosedForm(double angle) {
  Coefficients all;
  const double s = angle * angle, half = std::sin(0.5 * angle);
  const double versine = 2.0 * half * half;  // 1 - cos
  all.c = {std::cos(angle), std::sin(angle) / angle, versine / s,
           (angle - std::sin(angle)) / (s * angle), (0.5 * s - versine) / (s * s)};
  for (int n = 1; n <= 4; ++n) all.d[n] = (all.c[n - 1] - n * all.c[n]) / (2.0 * s);
  return all;
}

Coefficients At(const Vector3d& angle) {
  const double norm = angle.norm();
  return norm < kSmall_rad ? Series(norm * norm) : ClosedForm(norm);
}

/// I + f Th + g Th^2.
Matrix3d Combine(const Vector3d& angle, double f, double g) {
  const Matrix3d th = Skew(angle);
  return Matrix3d::Identity() + f * th + g * th * th;
}

/// d (I + f Th + g Th^2) x / d angle; df, dg: by the angle squared.
Matrix3d ByAngle(const Vector3d& angle, const Vector3d& x, double f, double g, double df,
                 double dg) {
  const Vector3d once = angle.cross(x), twice = angle.cross(once);
  const Matrix3d th = Skew(angle);
  return -f * Skew(x) - g * (Skew(once) + th * Skew(x)) +
         2.0 * (df * once + dg * twice) * angle.transpose();
}

}  // namespace

KollerMotion Plus(const KollerMotion& motion, const Vector15d& error) {
  KollerMotion moved = motion;
  moved.camera_from_world = PlusPose(motion.camera_from_world, error.head<6>());
  moved.velocity_m_s += error.segment<3>(6);
  moved.angular_velocity_rad_s += error.segment<3>(9);
  moved.acceleration_m_s2 += error.segment<3>(12);
  return moved;
}

Vector15d Minus(const KollerMotion& to, const KollerMotion& from) {
  const Rigid3 &a = to.camera_from_world, &b = from.camera_from_world;
  Vector15d error;
  error << a.translation - b.translation, LogQuaternion(b.rotation.conjugate() * a.rotation),
      to.velocity_m_s - from.velocity_m_s, to.angular_velocity_rad_s - from.angular_velocity_rad_s,
      to.acceleration_m_s2 - from.acceleration_m_s2;
  return error;
}

KollerIntegrals IntegrateKoller(const Vector3d& angle) {
  const auto [c, d] = At(angle);
  return {Combine(angle, c[1], c[2]), Combine(angle, c[2], c[3]),
          Combine(angle, 2.0 * c[3], 2.0 * c[4])};
}

KollerMotion PropagateKoller(const KollerMotion& motion, double dt,
                             const Eigen::Matrix<double, 6, 1>& impulse) {
  KollerMotion next = motion;
  next.angular_velocity_rad_s += impulse.head<3>();
  next.acceleration_m_s2 += impulse.tail<3>();
  const Vector3d angle = dt * next.angular_velocity_rad_s;
  const KollerIntegrals by = IntegrateKoller(angle);
  next.camera_from_world.translation =
      by.turn * motion.camera_from_world.translation + dt * by.velocity_gain * motion.velocity_m_s +
      0.5 * dt * dt * by.acceleration_gain * next.acceleration_m_s2;
  next.camera_from_world.rotation =
      (ExpQuaternion(angle) * motion.camera_from_world.rotation).normalized();
  next.velocity_m_s += dt * next.acceleration_m_s2;
  return next;
}

KollerJacobians LineariseKoller(const KollerMotion& motion, double dt, const KollerNoise& noise) {
  const Vector3d angle = dt * motion.angular_velocity_rad_s;
  const auto [c, d] = At(angle);
  const KollerIntegrals by = IntegrateKoller(angle);
  const double half = 0.5 * dt * dt;
  const Matrix3d next_world_from_camera =
      (by.turn * motion.camera_from_world.RotationMatrix()).transpose();
  KollerJacobians result;
  result.f.setIdentity();
  result.f.block<3, 3>(0, 0) = by.turn;
  result.f.block<3, 3>(0, 6) = dt * by.velocity_gain;
  result.f.block<3, 3>(0, 9) =
      dt *
      (ByAngle(angle, motion.camera_from_world.translation, c[1], c[2], d[1], d[2]) +
       dt * ByAngle(angle, motion.velocity_m_s, c[2], c[3], d[2], d[3]) +
       half * ByAngle(angle, motion.acceleration_m_s2, 2 * c[3], 2 * c[4], 2 * d[3], 2 * d[4]));
  result.f.block<3, 3>(0, 12) = half * by.acceleration_gain;
  // R' Exp(e) = Exp(angle + dt dw) R: the world side sees the turn's left error turned back.
  result.f.block<3, 3>(3, 9) = dt * next_world_from_camera * LeftJacobianSo3(angle);
  result.f.block<3, 3>(6, 12) = dt * Matrix3d::Identity();
  // Impulses go the way of what they change.
  Eigen::Matrix<double, 15, 6> g = result.f.rightCols<6>();
  g.leftCols<3>() *= dt * noise.angular_acceleration_rad_s2;
  g.rightCols<3>() *= dt * noise.jerk_m_s3;
  result.q.noalias() = g * g.transpose();
  return result;
}

CameraMotion ToCameraMotion(const KollerMotion& motion) {
  CameraMotion camera;
  camera.world_from_camera = motion.camera_from_world.Inverse();
  camera.velocity_m_s = -(camera.world_from_camera.rotation * motion.velocity_m_s);
  camera.angular_velocity_rad_s = -motion.angular_velocity_rad_s;
  return camera;
}

Matrix6d ToCameraPose(const Rigid3& camera_from_world) {
  const Matrix3d turn = camera_from_world.RotationMatrix();
  Matrix6d by = Matrix6d::Zero();
  by.topLeftCorner<3, 3>() = -turn.transpose();
  by.topRightCorner<3, 3>() = -turn.transpose() * Skew(camera_from_world.translation) * turn;
  by.bottomRightCorner<3, 3>() = -turn;
  return by;
}

Matrix6d FromCameraPose(const Rigid3& camera_from_world) {
  const Matrix3d turn = camera_from_world.RotationMatrix();
  Matrix6d by = Matrix6d::Zero();
  by.topLeftCorner<3, 3>() = -turn;
  by.topRightCorner<3, 3>() = Skew(camera_from_world.translation);
  by.bottomRightCorner<3, 3>() = -turn.transpose();
  return by;
}

}  // namespace saccade
