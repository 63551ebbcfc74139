#pragma once

#include <Eigen/Dense>
#include <span>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

struct WeightedPair {
  Eigen::Vector3d source = Eigen::Vector3d::Zero();
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  double weight = 1.0;  // > 0
};

/// target_from_source that minimises sum w |target - T source|^2 (Horn 1987, by SVD as in
/// Umeyama, PAMI 13(4), 1991). With fewer than three pairs, or if they lie on one line (second
/// singular value of the scatter below 1 % of the first) the rotation is the identity.
/// `pairs` must not be empty.
Rigid3 FitRigid(std::span<const WeightedPair> pairs);

}  // namespace saccade
