#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <optional>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A ray on which something was seen, in the camera at mid-exposure: `ray` + readout * `d_readout`,
/// where a rolling shutter's read-out time is not known yet.
struct StartRay {
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();       // unit
  Eigen::Vector3d d_readout = Eigen::Vector3d::Zero();  // [1/s], normal to the ray
  double sigma_rad = 1e-3;

  Eigen::Vector3d At(double readout_s) const { return (ray + readout_s * d_readout).normalized(); }
};

struct StartPoint {
  int anchor = 0;                                      // keyframe that saw it first
  StartRay seen;                                       // there
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, in the anchor: the estimate
  double inverse_range = 1.0;                          // [1/unit]: the estimate
};

struct StartSighting {
  int keyframe = 0;
  int point = 0;
  StartRay seen;
};

/// All that was seen since the camera was switched on, as one problem (slam-spec 7, targetless
/// start). Keyframe 0 is where the world begins; the scale is by convention.
struct StartProblem {
  std::vector<Rigid3> world_from_camera;  // of each keyframe: first guess, then estimate
  std::vector<StartPoint> points;
  std::vector<StartSighting> sightings;
  double readout_s = 0.0;        // of a rolling shutter: guess, then estimate
  double readout_sigma_s = 0.0;  // 0: it is known
};

/// What the pictures say of scale and depth.
struct StartEvidence {
  /// Relative sigma of the best-known distance between two keyframes against the distances to what
  /// was seen. Large: a camera that only turned, or was at rest.
  double scale_sigma = 1e9;
  int known_points = 0;   // whose range is known to a quarter
  double noise = 1.0;     // root mean square of the residuals, in their sigmas
  double agreeing = 0.0;  // share of sightings within three sigmas
  /// By how much the next best solution, one that goes another way, is worse: half of chi squared.
  double margin = 1e9;
};

/// `covariance` of the errors [read-out | 6 of each keyframe (position in world, rotation in the
/// camera) | 3 of each point (tangent of the bearing by TangentBasis, inverse range)]; the scale is
/// held where the distances to the points, weighed by what is known of them, are on the whole
/// right.
struct StartSolution {
  StartProblem problem;  // estimates
  StartEvidence evidence;
  Eigen::MatrixXd covariance;
};

/// Structure and motion at once, from three first guesses: the given one, one that only turns, and
/// the better of the two reversed. The better one is answered. Some 50 ms; `stop` ends it early.
/// Nothing: stopped, too little to solve, or no solution.
std::optional<StartSolution> SolveStart(const StartProblem& problem, const std::atomic<bool>& stop);

/// Changes the unit so that the median of the ranges is `range`; nothing that pictures tell
/// changes.
void ScaleTo(double range, StartSolution& solution);

}  // namespace saccade
