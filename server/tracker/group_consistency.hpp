#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

namespace saccade {

/// Of one match: where it was found against where the robust pose expects it.
struct GroupResidual {
  int group = 0;                                       // of matches that share a pose clone; from 0
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();  // [px]
  Eigen::Matrix<double, 2, 6> d_camera;                // by the camera's position and rotation
  Eigen::Matrix<double, 2, 3> d_turn;                  // by the clone's rotation [px/rad]
};

/// Which matches agree with one another, whatever the clones' own directions are: the camera's
/// error and a turn of each clone are fitted together (Tukey-weighted least squares), and what is
/// then more than 3 px off is false.
///
/// A clone that is known badly excuses each of its features alone, so the robust pose lets a false
/// one pass; but the joint update knows that they share the clone's error, and takes the false one
/// at its word. `camera_sigma`: of the error that the robust pose may still have [m, rad]. If less
/// than half would be left, nothing can be said, and all agree.
std::vector<bool> AgreeTogether(std::span<const GroupResidual> matches,
                                const Eigen::Matrix<double, 6, 1>& camera_sigma);

}  // namespace saccade
