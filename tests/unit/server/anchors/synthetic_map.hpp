#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "server/anchors/frame_ring.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade::testing {

/// A room of planes (walls, floor, desk, a box on it) with features on them, and what a tracker
/// would publish of it: estimates with noise drawn from the covariance that is published.
class SyntheticMap {
 public:
  struct Options {
    int features = 260;
    double depth_sigma = 0.01;  // of a feature along its ray, share of depth
    double lateral_sigma_px = 0.5;
    double pose_sigma_m = 0.002;
    double pose_sigma_rad = 0.001;
    unsigned seed = 1;
    bool metric = true;
  };

  SyntheticMap() : SyntheticMap(Options()) {}
  explicit SyntheticMap(const Options& options);

  /// First surface along a ray of the true room; distance from the origin [m].
  std::optional<double> Raycast(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;

  /// How many features in view within `radius_px` lie on the very surface that the pixel shows.
  int NeighboursOnSurface(const Rigid3& true_pose, const Eigen::Vector2d& pixel,
                          double radius_px) const;

  /// What the tracker says after a frame taken at `true_pose`; remembered for FrameRing.
  std::shared_ptr<const MapSnapshot> Snapshot(const Rigid3& true_pose);
  /// Adds the frame of the last Snapshot to `ring`.
  void PushTo(FrameRing& ring) const;

  /// Applies a rigid correction and noise to all estimates, and raises the revision.
  void Correct(const Rigid3& new_from_old, double feature_sigma_m);
  /// New map: other ids, other generation.
  void Reset(bool metric);
  void Remove(FeatureId id);
  FeatureId Add(const Eigen::Vector3d& true_point, double sigma_m);
  /// Makes one estimate as good as `sigma_m` along its ray from the origin, 2 mm across.
  void Improve(FeatureId id, double sigma_m);

  const std::shared_ptr<const CameraModel>& camera() const { return camera_; }
  Eigen::Vector3d estimate(FeatureId id) const;
  std::size_t size() const { return features_.size(); }
  FeatureId id(std::size_t index) const { return features_[index].id; }
  std::mt19937& random() { return random_; }
  Eigen::Vector3d Noise(double sigma);
  TrackingStatus status = TrackingStatus::kTracking;
  FrameId next_frame = 1;

 private:
  struct Feature {
    FeatureId id;
    Eigen::Vector3d truth, estimate;
    Eigen::Matrix3d covariance;
    std::uint32_t matched = 30;
    int surface = -1;
  };
  std::optional<double> Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                            int* surface) const;

  void Populate();

  Options options_;
  std::mt19937 random_;
  std::shared_ptr<const CameraModel> camera_;
  std::vector<Feature> features_;
  Rigid3 estimate_from_truth_;
  FeatureId next_id_ = 1;
  std::uint64_t revision_ = 0, generation_ = 1;
  bool metric_;
  std::shared_ptr<const MapSnapshot> last_;
};

/// A camera at `position` that is turned by yaw (to the right) and pitch (down) [rad].
Rigid3 LookFrom(const Eigen::Vector3d& position, double yaw, double pitch);

}  // namespace saccade::testing
