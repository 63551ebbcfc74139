#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A camera pose of the adjustment.
struct BundleKeyframe {
  Rigid3 world_from_camera;
  bool fixed = false;  // holds place and scale; not adjusted
};

/// A point as the filter writes it: bearing and inverse range in the keyframe that saw it first.
struct BundlePoint {
  int anchor = 0;                                      // index of that keyframe
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, in the anchor
  double inverse_range = 1.0;                          // [1/m]
  Eigen::Vector3d seen = Eigen::Vector3d::UnitZ();     // bearing as measured in the anchor
  double seen_sigma_rad = 1e-3;
  double prior_inverse_range = 1.0, prior_sigma = 1.0;  // what is known besides sightings [1/m]
  double parallax_sigmas = 0.0;  // of the widest pair of sightings, in sigmas of a sighting
};

/// One match: the ray on which a keyframe saw a point.
struct BundleSighting {
  int keyframe = 0;
  int point = 0;
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();  // unit, in the keyframe
  double sigma_rad = 1e-3;
};

/// The same of a point that is known and not adjusted (a target's).
struct BundleKnownSighting {
  int keyframe = 0;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();
  double sigma_rad = 1e-3;
};

struct BundleProblem {
  std::vector<BundleKeyframe> keyframes;
  std::vector<BundlePoint> points;
  std::vector<BundleSighting> sightings;
  std::vector<BundleKnownSighting> known;
  int iterations = 8;  // at most: fixed, not a time, so that offline runs repeat to the bit
};

/// Least squares over keyframes and points, Cauchy loss on sightings (Triggs et al. 2000), in
/// place.
///
/// Where less than two keyframes are fixed and no known point is seen, the first keyframe is held
/// and the scale of the inverse ranges is kept: neither can be seen in pictures. Runs for 10 to 300
/// ms; `stop` ends it early. False: nothing to adjust, stopped, or no solution; `problem` is then
/// as it was.
bool AdjustBundle(BundleProblem& problem, const std::atomic<bool>& stop);

}  // namespace saccade
