#pragma once

#include <Eigen/Core>
#include <optional>

#include "server/mount/mount_options.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Where to turn the joints so that the optic axis meets a point.
struct FixationAngles {
  MountAngles angles;
  bool reachable = true;  // false: `angles` look as near to the point as the limits let them
  double miss_rad = 0;    // angle between the optic axis at `angles` and the point
};

/// Kinematics of a mount (slam-spec section 8; docs/derivations/mount.md). Frames: `mount` is the
/// base on the wearer (S), `camera` the optic centre (C); both x right, y down, z forward at zero.
/// Immutable.
class MountModel {
 public:
  /// `options` must be valid.
  explicit MountModel(const MountOptions& options = {}) : options_(options) {}

  const MountOptions& options() const { return options_; }

  /// T_SC.
  Rigid3 MountFromCamera(const MountAngles& angles) const;

  /// d MountFromCamera / d angles, 6 x 3: rows [position in mount (m/rad); rotation, local in the
  /// camera (rad/rad)], columns pan, elevation, cyclotorsion.
  Eigen::Matrix<double, 6, 3> Jacobian(const MountAngles& angles) const;

  /// Angular velocity of the camera against the mount, in camera [rad/s].
  Eigen::Vector3d AngularVelocity(const MountAngles& angles, const Eigen::Vector3d& rates) const {
    return Jacobian(angles).bottomRows<3>() * rates;
  }

  /// Fixation on `point_in_mount` [m]. Of several turns that do, the one nearest to `near`.
  /// `down_in_mount` (any length) levels the camera's x axis, as far as the joints let it; without
  /// it the torsion stays that of `near`. The point must be finite and not at the optic centre.
  FixationAngles Fixate(const Eigen::Vector3d& point_in_mount,
                        const std::optional<Eigen::Vector3d>& down_in_mount,
                        const MountAngles& near) const;

  /// `angles` with the torsion that levels the camera's x axis, within the joint's limits. Looking
  /// along `down` itself there is no level: the torsion stays.
  MountAngles Level(const Eigen::Vector3d& down_in_mount, const MountAngles& angles) const;

  MountAngles Clamp(const MountAngles& angles) const;
  bool WithinLimits(const MountAngles& angles, double tolerance_rad = 1e-9) const;

  /// Angle between the optic axis at `angles` and a point [rad].
  double Miss(const MountAngles& angles, const Eigen::Vector3d& point_in_mount) const;

 private:
  MountAngles Seed(const Eigen::Vector3d& direction_in_mount, const MountAngles& near) const;
  MountAngles Refine(const Eigen::Vector3d& point_in_mount, MountAngles angles) const;

  MountOptions options_;
};

}  // namespace saccade
