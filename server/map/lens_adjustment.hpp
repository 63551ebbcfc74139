#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <optional>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What is learnt of a lens: [log of the focal length in px, cx [px], cy [px], k1 k2 p1 p2 k3],
/// pixels square, distortion as Brown-Conrady.
inline constexpr int kLensSize = 8;
using LensVector = Eigen::Matrix<double, kLensSize, 1>;
using LensMatrix = Eigen::Matrix<double, kLensSize, kLensSize>;

/// The camera that such a vector means: size, rate and shutter of `like`.
CameraIntrinsics LensOf(const LensVector& lens, const CameraIntrinsics& like);
/// The vector nearest to a pinhole or Brown-Conrady camera: what it has no number for is dropped.
LensVector LensVectorOf(const CameraIntrinsics& camera);

/// Keyframes, points and pixels, to be adjusted together with the lens they were seen through.
struct LensBundle {
  struct Point {
    int anchor = 0;                                      // keyframe that saw it first
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, there: the estimate
    double inverse_range = 1.0;                          // [1/m]: the estimate
    Eigen::Vector2d seen = Eigen::Vector2d::Zero();      // there [px]
    double sigma_px = 1.0;
  };
  struct Sighting {
    int keyframe = 0;
    int point = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double sigma_px = 1.0;
  };
  /// Of a target's point, which is not adjusted.
  struct KnownSighting {
    int keyframe = 0;
    Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double sigma_px = 1.0;
  };
  std::vector<Rigid3> world_from_camera;
  std::vector<Point> points;
  std::vector<Sighting> sightings;
  std::vector<KnownSighting> known;
  LensVector lens = LensVector::Zero();  // guess, then estimate
  LensVector prior = LensVector::Zero();
  LensMatrix prior_covariance = LensMatrix::Identity();
};

struct LensBundleSolution {
  LensBundle problem;                              // estimates
  LensMatrix covariance;                           // of the lens, whatever the rest is
  double rms_px_before = 0.0, rms_px_after = 0.0;  // of the sightings, large ones cut off
  int observations = 0;
};

/// Adjusts all of it (self-calibration; Triggs et al., Bundle Adjustment, 2000; Cauchy loss). Where
/// no known point is seen, the first keyframe is held, and so is the sum of the distances from
/// there. Nothing: stopped, too little to go by, no solution, or a lens that cannot be inverted
/// within the picture of `like`. Some 0.1 s for 20 keyframes, seconds for 100.
std::optional<LensBundleSolution> AdjustLens(LensBundle problem, const CameraIntrinsics& like,
                                             const std::atomic<bool>& stop);

}  // namespace saccade
