#pragma once

#include <Eigen/Core>

namespace saccade {

/// What is known of a lens that is learnt while it is tracked, each with its sigma.
struct LensState {
  double focal_px = 0, focal_sigma_px = 0;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero(), centre_sigma_px = Eigen::Vector2d::Zero();
  double k1 = 0, k1_sigma = 0, k2 = 0, k2_sigma = 0;  // Brown-Conrady
  bool learnt = false;                                // as good as a measured one
  int changes = 0;                                    // of the lens so far
};

}  // namespace saccade
