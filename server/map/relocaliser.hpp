#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "server/features/pose_fit.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

struct RelocaliserOptions {
  int max_keyframes = 100;  // beyond, the most redundant one is dropped
  int max_points = 500;     // of a keyframe
  int max_corners = 700;    // described in the queried picture
  int candidates = 8;       // keyframes tried in full, best thumbnails first
  double ratio = 0.75;      // best / second-best descriptor distance
  int max_hamming = 64;     // of 256
  int min_inliers = 12;
  double inlier_px = 3.0;
  std::uint64_t seed = 1;
  absl::Status Validate() const;
};

/// A map feature as seen in a keyframe.
struct KeyframePoint {
  FeatureId id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();           // [px, distorted]
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m] then; may move later
};

/// A map feature found again in the queried picture.
struct Correspondence {
  FeatureId id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // as used for the pose
};

struct Relocalisation {
  Rigid3 world_from_camera;
  Matrix6d pose_covariance = Matrix6d::Zero();  // of the PnP alone: never insert it (slam-spec 6)
  std::vector<Correspondence> inliers;          // each id once
  FrameId keyframe = 0;                         // that led to it
  double rms_px = 0.0;
};

/// Finds where the camera is after tracking was lost, from keyframes of the map.
///
/// Each keyframe keeps a thumbnail and, for each map feature visible in it, ORB descriptors at
/// several scales. A query matches them to corners of the picture, best thumbnails first, and
/// accepts a pose that at least `min_inliers` features support. Memory: about 30 KB a keyframe.
/// One thread (the tracker's).
class Relocaliser {
 public:
  /// Where a feature is now [m, world]; nothing if it was deleted (its matches are not used).
  using PointLookup = std::function<std::optional<Eigen::Vector3d>(FeatureId)>;

  explicit Relocaliser(const RelocaliserOptions& options);

  /// Stores a view of the map; about 2 ms. Points less than 20 px from the border are left out.
  /// InvalidArgument: not 8-bit grey, or fewer than `min_inliers` usable points.
  absl::Status AddKeyframe(FrameId frame, const cv::Mat& grey, const Rigid3& world_from_camera,
                           std::span<const KeyframePoint> points);

  /// True if no keyframe shows the map from near this pose: worth an AddKeyframe().
  bool NeedsKeyframe(const Rigid3& world_from_camera, double min_distance_m,
                     double min_angle_rad) const;

  /// Pose and supporting features of the picture, or nothing. `lookup` null: points are where they
  /// were when the keyframe was added. Typically below 30 ms at 640 x 480.
  std::optional<Relocalisation> Query(const cv::Mat& grey, const CameraModel& camera,
                                      const PointLookup& lookup = nullptr) const;

  void Clear() { keyframes_.clear(); }
  std::size_t size() const { return keyframes_.size(); }

 private:
  static constexpr int kScales = 3;
  using Descriptor = std::array<std::uint64_t, 4>;
  struct Keyframe {
    FrameId frame = 0;
    Rigid3 world_from_camera;
    cv::Mat thumbnail;  // CV_32FC1, blurred, zero mean, unit norm
    std::vector<KeyframePoint> points;
    std::vector<Descriptor> descriptors;  // kScales per point, consecutive
    std::vector<std::uint8_t> present;    // per descriptor
  };
  struct Described;

  Described Describe(const cv::Mat& grey) const;
  std::vector<int> Shortlist(const cv::Mat& thumbnail) const;
  std::optional<Relocalisation> TryKeyframe(const Keyframe& keyframe, const Described& picture,
                                            const CameraModel& camera,
                                            const PointLookup& lookup) const;

  RelocaliserOptions options_;
  std::vector<Keyframe> keyframes_;
};

}  // namespace saccade
