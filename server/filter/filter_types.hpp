#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "server/filter/constant_velocity.hpp"
#include "server/filter/point_model.hpp"
#include "shared/scene/map_snapshot.hpp"

// What enters FilterState and leaves it.
namespace saccade {

using CloneId = std::uint32_t;
/// A moving camera of the state. The first is there from the start.
using RobotId = std::uint32_t;
inline constexpr RobotId kFirstRobot = 0;

/// A feature as it enters the state: seen at `bearing` from a pose clone.
struct FeatureBirth {
  FeatureId id = 0;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();            // unit, in the clone
  Eigen::Matrix3d bearing_covariance = Eigen::Matrix3d::Zero();  // of the bearing
  double inverse_range = 1.0;                                    // [1/m]
  double inverse_range_sigma = 0.5;                              // [1/m]
};

/// One matched pixel: of a feature, or of a point that is known and therefore outside the state.
struct Observation {
  FeatureId id = 0;
  std::optional<Eigen::Vector3d> known_point;  // [m, world]; then `id` is not looked at
  /// Of a marker (AddMarker): then known_point is in its frame; 0: in world.
  CloneId marker = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Identity();  // R [px^2]
  /// d pixel / d read-out time [px/s]; `pixel` is corrected with the filter's present read-out.
  Eigen::Vector2d d_readout = Eigen::Vector2d::Zero();
};

/// What a prediction's errors look like: z - h = -noise, split by where it comes from.
struct PredictedPixel {
  PixelPrediction at;          // linearised at the filter's camera pose
  Eigen::Matrix2d covariance;  // H P H^T [px^2], without measurement noise
  /// Cov(H error, camera pose error) [position, rotation].
  Eigen::Matrix<double, 2, 6> with_camera;
};

struct FeatureMarginal {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();        // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();   // [m^2]
  Eigen::Matrix3d covariance_in_camera = Eigen::Matrix3d::Zero();  // cross terms included [m^2]
  double inverse_range = 0.0, inverse_range_sigma = 0.0;           // from the clone [1/m]
};

struct UpdateReport {
  int rows = 0;
  double nis = 0.0;  // r^T S^-1 r, of `rows` degrees of freedom
};

/// Estimates that are better than the filter's were at its checkpoint.
struct Refinement {
  struct Feature {
    Eigen::Vector3d bearing;  // unit, in its clone
    double inverse_range;     // [1/m]
  };
  std::map<CloneId, Rigid3> clones;
  std::map<FeatureId, Feature> features;
  std::optional<Rigid3> world_from_camera;  // of the robot, at the checkpoint
};

/// A map that was found elsewhere, from the same pictures, for an empty filter.
struct MapSeed {
  struct Feature {
    FeatureId id = 0;                                            // rising
    int clone = 0;                                               // index into `clones`
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();          // unit, in the clone
    Eigen::Matrix2d birth_covariance = Eigen::Matrix2d::Zero();  // of one match there [rad^2]
    double inverse_range = 1.0;                                  // [1/m]
  };
  std::vector<Rigid3> clones;  // world from camera, in order of time
  std::vector<Feature> features;
  double readout_s = 0.0;
  /// Of [read-out | 6 of each clone | 3 of each feature, tangent by TangentBasis].
  Eigen::MatrixXd covariance;
};

/// A further moving camera of the state, or one that stands still.
struct RobotOptions {
  const MotionModel* motion = &ConstantVelocity();
  double readout_s = 0.0;  // as FilterOptions
  double readout_sigma_s = 0.0;
};

struct FilterOptions {
  /// Jacobians at first estimates (slam-spec 1): always, or for the first updates of a map, while
  /// the present ones still jump. docs/derivations/first-estimates.md.
  bool fej = false;
  int fej_updates = 60;
  PointForm form = PointForm::kBearingRange;
  /// Read-out time of the first robot's rolling shutter, first to last row [s], and how sure that
  /// is; sigma 0: as given, not estimated.
  double readout_s = 0.0;
  double readout_sigma_s = 0.0;
  /// Updates after which a change of scale is kept unobserved (docs/derivations/scale.md); before,
  /// the first depths are still being sorted out.
  int carry_scale_after = 60;
  /// Inverse ranges whose clone's matches a turn alone explains to within this many standard
  /// deviations are left as they are (docs/derivations/parallax.md); 0: always corrected.
  double parallax_sigmas = 3.0;
  double min_inverse_range = 1e-4;  // [1/m]; of points given in metres (the state may pass 0)
};

}  // namespace saccade
