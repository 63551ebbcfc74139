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
#include "server/map/picture_description.hpp"
#include "server/map/view_corners.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/geometry/similarity3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

struct RelocaliserOptions {
  int max_views = 100;      // beyond, the most redundant one is dropped
  int max_points = 500;     // of a view
  int scene_corners = 500;  // of a view, looked for by Densify()
  int max_corners = 700;    // described in the queried picture
  int candidates = 8;       // views tried in full, best thumbnails first
  double ratio = 0.75;      // best / second-best descriptor distance
  int max_hamming = 64;     // of 256
  int min_inliers = 12;     // two thirds of them by descriptor alone
  double inlier_px = 3.0;
  std::uint64_t seed = 1;
  absl::Status Validate() const;
};

/// A map feature as seen in a view.
struct ViewPoint {
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
  FrameId view = 0;                             // that led to it
  double rms_px = 0.0;
};

/// Finds where the camera is after tracking was lost, from views of the map.
///
/// Each view keeps a thumbnail and, for each map feature visible in it, ORB descriptors at
/// several scales. A query matches them to corners of the picture, best thumbnails first, and
/// accepts a pose that at least `min_inliers` features support; failing that, one that 24 features
/// and corners of the views' pictures support, which Densify() triangulates. Memory: about 160
/// bytes a point or corner and 5 KB a view, and its picture until Densify() was there.
/// One thread (the tracker's).
class Relocaliser {
 public:
  /// Where a feature is now [m, world]; nothing if it was deleted (its matches are not used).
  using PointLookup = std::function<std::optional<Eigen::Vector3d>(FeatureId)>;

  explicit Relocaliser(const RelocaliserOptions& options);

  /// Stores a view of the map; about 2 ms. Points less than 20 px from the border are left out.
  /// InvalidArgument: not 8-bit grey, or fewer than `min_inliers` usable points.
  absl::Status AddView(FrameId frame, const cv::Mat& grey, const Rigid3& world_from_camera,
                       std::span<const ViewPoint> points);

  /// True if no view shows the map from near this pose: worth an AddView().
  bool NeedsView(const Rigid3& world_from_camera, double min_distance_m,
                 double min_angle_rad) const;

  /// Pose and supporting features of the picture, or nothing. `lookup` null: points are where they
  /// were when the view was added. Typically below 30 ms at 640 x 480.
  std::optional<Relocalisation> Query(const cv::Mat& grey, const CameraModel& camera,
                                      const PointLookup& lookup = nullptr) const;

  /// One step (a few ms) towards more points than the map's features: corners of the views'
  /// pictures, triangulated between them. They help to recognise a place and are never returned;
  /// they move with their view's features. False: nothing is left to do.
  bool Densify(const CameraModel& camera, const PointLookup& lookup = nullptr);

  /// The map was moved: `moved` says how what lies at a feature moves; nothing if it was deleted.
  void Move(const std::function<std::optional<Similarity3>(FeatureId)>& moved);

  void Clear() { views_.clear(); }
  std::size_t size() const { return views_.size(); }

  struct PlaceView {
    FrameId frame = 0;
    Rigid3 world_from_camera;
    cv::Mat thumbnail;
    std::vector<ViewPoint> points;
    std::vector<DescribedPoint> described;  // of points
    cv::Mat grey;                           // until its corners are described
    ViewCorners corners;
    std::vector<FrameId> partners;  // views its corners are yet to be matched to
  };
  /// All of it, for a file.
  const std::vector<PlaceView>& views() const { return views_; }
  /// In place of what it holds. Their frames are another run's: they get names that none of this
  /// one has.
  void Load(std::vector<PlaceView> views);

 private:
  /// A feature or a corner of a view, where it is now.
  struct Known {
    FeatureId id = 0;  // a corner: kCornerBit and its place
    const DescribedPoint* look = nullptr;
    Eigen::Vector3d point_in_world;
  };
  using Scene = std::vector<std::vector<Known>>;  // by view
  struct Match {
    FeatureId id = 0;
    int corner = 0;  // into the picture's described corners
    Eigen::Vector3d point_in_world;
  };

  /// Inliers that a pose needs.
  struct Bar {
    int by_descriptor = 0;  // wherever in the picture they are
    int guided = 0;         // near where the pose predicts them
  };

  /// Views most like the picture, best first, at most options.candidates; none of which too
  /// little is known in `scene`.
  std::vector<int> Shortlist(const cv::Mat& thumbnail, const std::vector<DescribedPoint>& corners,
                             const Scene& scene) const;
  /// Where the view was taken, by where its features are now; nothing if they disagree.
  std::optional<Rigid3> PoseNow(const PlaceView& view, const CameraModel& camera,
                                const PointLookup& lookup) const;
  std::vector<Known> KnownFeatures(const PlaceView& view, const PointLookup& lookup) const;
  void AppendCorners(int view, const CameraModel& camera, const PointLookup& lookup,
                     std::vector<Known>& known) const;
  std::vector<Match> MatchView(const std::vector<Known>& known,
                               const std::vector<DescribedPoint>& corners) const;
  /// The pose that `matches` agree on, checked against the whole scene; nothing if in doubt.
  std::optional<Relocalisation> Confirm(const std::vector<Match>& matches, FrameId view,
                                        const CameraModel& camera,
                                        const std::vector<DescribedPoint>& corners,
                                        const Scene& scene, const Bar& bar) const;
  /// What `pose` predicts near a corner of its look.
  std::vector<Match> MatchGuided(const Rigid3& world_from_camera, const CameraModel& camera,
                                 const std::vector<DescribedPoint>& corners,
                                 const Scene& scene) const;
  void DropMostRedundant();

  void ChoosePartners(PlaceView& view) const;
  /// Each candidate's matches in turn, then all of them together.
  std::optional<Relocalisation> TryCandidates(const std::vector<int>& candidates,
                                              const Scene& scene, const CameraModel& camera,
                                              const std::vector<DescribedPoint>& corners,
                                              const Bar& bar) const;
  PlaceView* Find(FrameId frame);

  RelocaliserOptions options_;
  std::vector<PlaceView> views_;
};

}  // namespace saccade
