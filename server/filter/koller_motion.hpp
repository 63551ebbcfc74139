#pragma once

#include <Eigen/Dense>

#include "server/filter/motion_model.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// M3 (slam-spec 3): the world turns and moves about the camera with a constant angular velocity
/// and an acceleration that is constant in the camera's axes: every point p of it obeys
/// p. = velocity + angular_velocity x p, velocity. = acceleration.
///
/// Errors: [translation, rotation (on the right), velocity, angular velocity, acceleration], 3
/// each.
struct KollerMotion {
  Rigid3 camera_from_world;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();            // in camera
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // of the world, in camera
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();       // in camera
};

/// `motion` [+] `error`, and its inverse `to` [-] `from`.
KollerMotion Plus(const KollerMotion& motion, const Vector15d& error);
Vector15d Minus(const KollerMotion& to, const KollerMotion& from);

/// Impulses within one step: standard deviations of what M3 takes for zero. Smaller than M1's: with
/// more, an acceleration is guessed from the noise of three pictures, and predicts worse than none.
struct KollerNoise {
  double angular_acceleration_rad_s2 = 3.0;
  double jerk_m_s3 = 10.0;  // a head that sways by a decimetre once a second
};

/// The integrals over a step of exp([angle]x s): a point goes to
/// turn p + dt velocity_gain v + dt^2 / 2 acceleration_gain a. Exact; by their series for small
/// angles, where the closed forms lose all digits.
struct KollerIntegrals {
  Eigen::Matrix3d turn, velocity_gain, acceleration_gain;  // R, S, T
};
KollerIntegrals IntegrateKoller(const Eigen::Vector3d& angle_rad);

/// On by `dt` seconds. `impulse` [angular velocity, acceleration] comes before: zero for the mean.
KollerMotion PropagateKoller(
    const KollerMotion& motion, double dt,
    const Eigen::Matrix<double, 6, 1>& impulse = Eigen::Matrix<double, 6, 1>::Zero());

struct KollerJacobians {
  Matrix15d f;  // d next error / d error
  Matrix15d q;  // covariance that the step adds
};
KollerJacobians LineariseKoller(const KollerMotion& motion, double dt, const KollerNoise& noise);

/// The same motion in the product's convention: camera in world.
CameraMotion ToCameraMotion(const KollerMotion& motion);
/// Errors of the pose of the camera in world [position (world), rotation (local)] by M3's first
/// six, and those by the errors of the pose.
Matrix6d ToCameraPose(const Rigid3& camera_from_world);
Matrix6d FromCameraPose(const Rigid3& camera_from_world);

}  // namespace saccade
