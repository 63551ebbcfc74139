#pragma once

#include <Eigen/Dense>
#include <optional>
#include <span>

#include "server/team/merge/common_place.hpp"

namespace saccade {

/// The two maps that meet.
enum class MapSide { kOwn, kOther };

/// A common place, and whose map it was recognised in.
struct JoinedPlace {
  MapSide mapped = MapSide::kOwn;
  CommonPlace place;
};

using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// How one map lies in the other.
struct MapFit {
  Similarity3 own_from_other;
  /// Of a change [translation (own units), rotation rad, log scale] applied on the left:
  /// p_own + t + w x p_own + s p_own. Scale's rows are zero where both maps are metric.
  Matrix7d covariance = Matrix7d::Zero();
  double rms_px = 0.0;  // of what agrees
  int points = 0;       // that agree
};

/// Fits the similarity to everything that places show of each other, in both directions, by
/// reprojection through the lenses (Gauss-Newton, Huber). The covariance is a sandwich over places:
/// points of one picture share their errors. Nothing: fewer than 24 points agree, or they leave a
/// direction free.
std::optional<MapFit> FitMaps(std::span<const JoinedPlace* const> places,
                              const Similarity3& initial, bool metric);

}  // namespace saccade
