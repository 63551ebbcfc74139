#pragma once

#include <Eigen/Dense>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// What an inertial unit that is fixed to a camera needs to be told (inertial_motion.hpp).
struct ImuState {
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();          // in the unit
  Eigen::Vector3d accelerometer_bias_m_s2 = Eigen::Vector3d::Zero();  // in the unit
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d::Zero();             // in world, downwards
  double offset_s = 0.0;  // its clock is so much ahead: what it stamps t happened at t - offset_s
  Rigid3 camera_from_imu;
};

/// What the filter knows of the moving camera: 13 numbers, 12 error dimensions in the order
/// [position (world), rotation (local, on the right), velocity (world), angular velocity (camera)].
struct CameraMotion {
  Rigid3 world_from_camera;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  // in world; of the unit, where one is
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // in camera
  ImuState imu;
};

/// `camera` [+] `error`, and its inverse `to` [-] `from` (slam-spec section 1).
CameraMotion Plus(const CameraMotion& camera, const Vector12d& error);
Vector12d Minus(const CameraMotion& to, const CameraMotion& from);

/// Impulses that M1 allows itself within one step: standard deviations of the accelerations.
struct MotionNoise {
  double acceleration_m_s2 = 4.0;            // handheld [SL2]
  double angular_acceleration_rad_s2 = 6.0;  // handheld [SL2]
};

struct MotionJacobians {
  Matrix12d f = Matrix12d::Identity();  // d next error / d error
  Matrix12d q = Matrix12d::Zero();      // covariance that the step adds
};

/// What a mount's joints did to the camera in one step, by its encoders; the wearer's motion comes
/// on top.
struct HeadMotion {
  /// Where the optic centre would have gone had the wearer stood still.
  Rigid3 camera_from_next;
  /// Of its errors [position, in the camera before; rotation, local in the camera after].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// The camera after its joints have moved. The velocities, which are those of a camera whose joints
/// stand still, go along: the same motion of the wearer, seen at the new place.
CameraMotion TurnHead(const CameraMotion& camera, const Rigid3& camera_from_next);
/// Its Jacobians; `q` is what the encoders' errors add.
MotionJacobians LineariseHead(const CameraMotion& camera, const HeadMotion& head);

/// How a camera moves, and what of its motion is in the state. Without state of its own; one file
/// for each model.
///
/// Errors begin with the pose's six [position (world), rotation (local)].
class MotionModel {
 public:
  static constexpr int kMostErrors = 19;
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostErrors, 1>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostErrors, kMostErrors>;

  /// A step of the mean, its F and the Q that it adds.
  struct Step {
    CameraMotion next;
    Square f, q;
  };

  virtual ~MotionModel() = default;

  /// Error dimensions.
  int dim() const { return dim_; }
  /// Where the errors of [velocity (world), angular velocity (camera)] are; below 0: it has none.
  int velocities() const { return velocities_; }
  /// How many of CameraMotion's errors its own begin with, in the same order.
  int common() const { return common_; }
  /// What of a covariance of all errors of CameraMotion is in the state.
  Square InState(const Matrix12d& covariance) const {
    Square in_state = Square::Zero(dim_, dim_);
    in_state.topLeftCorner(common_, common_) = covariance.topLeftCorner(common_, common_);
    return in_state;
  }

  /// `motion` [+] `error`, and its inverse `to` [-] `from`.
  virtual CameraMotion Plus(const CameraMotion& motion, const Errors& error) const = 0;
  virtual Errors Minus(const CameraMotion& to, const CameraMotion& from) const = 0;
  /// On by `dt` seconds; `first_rotation` as LineariseMotion().
  virtual Step Predict(const CameraMotion& motion, const Eigen::Quaterniond& first_rotation,
                       double dt, const MotionNoise& noise) const = 0;
  /// As TurnHead().
  virtual Step Turn(const CameraMotion& motion, const HeadMotion& head) const = 0;

  /// Of an error, what a wrong scale of the world would look like; the rest zero.
  virtual Errors OfScale(const Errors& error) const = 0;
  /// Errors by those of the pose that the world is counted from (docs/derivations/gauge.md), into
  /// `rows` (dim x 6, zero).
  virtual void ByOrigin(const CameraMotion& motion, const Rigid3& origin,
                        Eigen::Ref<Eigen::MatrixXd> rows) const = 0;
  /// Errors in a world that is turned and scaled by `turn`, by those in the one before.
  virtual Square InMovedWorld(const Eigen::Matrix3d& turn) const = 0;

 protected:
  MotionModel(int dim, int velocities) : MotionModel(dim, velocities, dim) {}
  MotionModel(int dim, int velocities, int common)
      : dim_(dim), velocities_(velocities), common_(common) {}

 private:
  const int dim_, velocities_, common_;
};

/// A camera that stands still: 6 errors, and no prediction adds to them.
const MotionModel& StandingStill();

/// `pose` [+] `error` [position (world), rotation (local)].
Rigid3 PlusPose(const Rigid3& pose, const Eigen::Matrix<double, 6, 1>& error);

/// A pose's errors by those of the pose that the world is counted from, into `rows` (6 x 6, zero):
/// by its error (dr, th) the world has turned by R th about it and moved by dr.
void PoseByOrigin(const Rigid3& pose, const Rigid3& origin, Eigen::Ref<Eigen::MatrixXd> rows);

}  // namespace saccade
