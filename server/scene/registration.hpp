#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "shared/geometry/similarity3.hpp"

namespace saccade {

/// The same point in a model and in the map.
struct PointPair {
  Eigen::Vector3d point_in_model = Eigen::Vector3d::Zero();  // [m]
  Eigen::Vector3d point_in_map = Eigen::Vector3d::Zero();    // [m, or the map's own unit]
};

struct Registration {
  Similarity3 map_from_model;    // scale 1 where it was not asked for
  double rms_m = 0;              // of the distances in the map
  std::vector<double> errors_m;  // of each, in the order given
  /// What each would be off by if the others alone had registered the model: the error to expect
  /// at a point that was not clicked.
  std::vector<double> left_out_errors_m;
  double left_out_rms_m = 0;
};

struct RegistrationOptions {
  bool with_scale = false;       // for maps without metres
  double least_spread_m = 0.05;  // of the points across their longest line (root mean square)
};

/// Least squares over at least four correspondences (Umeyama, PAMI 13(4), 1991).
///   InvalidArgument     fewer than four, or not finite; names the index
///   FailedPrecondition  points in one place or on one line, in the model or in the map, also once
///                       any one of them is left out; or the map shows the model mirrored
absl::StatusOr<Registration> Register(std::span<const PointPair> pairs,
                                      const RegistrationOptions& options = {});

}  // namespace saccade
