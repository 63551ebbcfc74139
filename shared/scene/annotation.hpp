#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

enum class AnnotationShape { kCube, kNote, kArrow, kInk };

/// Slam-spec section 9; semantics of ARCore's TRACKING / PAUSED / STOPPED.
enum class AnchorState { kProvisional, kTracking, kPaused, kStopped };

/// Where the expert clicked. Exactly one.
struct PixelTarget {
  FrameId frame_id = 0;                             // the frame whose picture the expert saw
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // raw picture, full resolution, distorted [px]
};
struct FeatureTarget {
  FeatureId feature_id = 0;
};
struct PointTarget {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
};
struct RayTarget {
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();      // [m]
  Eigen::Vector3d direction_in_world = Eigen::Vector3d::UnitZ();  // any length > 0
};
using AnnotationTarget = std::variant<PixelTarget, FeatureTarget, PointTarget, RayTarget>;

/// A request to place something, already validated (finite numbers, known shape).
struct AnnotationDraft {
  std::string request_id;  // UUID of the caller; a repeated one answers with the first result
  AnnotationShape shape = AnnotationShape::kCube;
  std::string text;
  std::string author;
  double size_m = 0.05;
  std::uint32_t color_rgba = 0xffffffff;
  AnnotationTarget target;
  std::vector<Eigen::Vector2d> ink_px;  // kInk: stroke in the target's frame [px]
};

/// How a click became a point: slam-spec section 9, in order of preference.
enum class AnchorMethod { kScene, kFeature, kPlane, kMedianDepth, kPoint };

/// The live estimate behind an annotation, recomputed for each frame.
struct Anchor {
  AnchorState state = AnchorState::kProvisional;
  AnchorMethod method = AnchorMethod::kMedianDepth;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();       // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();  // [m^2]
  /// Expected error: 1 sigma, largest axis. px is nothing while out of view.
  double error_m = 0.0;
  std::optional<double> error_px;
  std::optional<Eigen::Vector2d> pixel;  // where it is in the newest frame [px, distorted]
  std::string reason;                    // why paused or stopped, in words
  /// False: the point is of another map and means nothing in this one; nothing is to be drawn.
  bool place_known = true;
};

/// The points of an ink stroke: never changed once made, so that copies share them. An annotation
/// is copied for every frame, for what can be undone and for every reader; its stroke is not.
class InkStroke {
 public:
  using Points = std::vector<Eigen::Vector3d>;

  InkStroke() = default;
  InkStroke(Points points)  // NOLINT(google-explicit-constructor): a list of points is a stroke
      : made_(points.empty() ? nullptr : std::make_shared<const Made>(std::move(points))) {}
  InkStroke(std::initializer_list<Eigen::Vector3d> points) : InkStroke(Points(points)) {}

  bool empty() const { return made_ == nullptr; }
  std::size_t size() const { return empty() ? 0 : made_->points.size(); }
  const Eigen::Vector3d* begin() const { return empty() ? nullptr : made_->points.data(); }
  const Eigen::Vector3d* end() const { return begin() + size(); }
  const Eigen::Vector3d& operator[](std::size_t i) const { return made_->points[i]; }
  std::size_t bytes() const { return size() * sizeof(Eigen::Vector3d); }

  /// Distance of its farthest point from the anchor, and its length along all points [m].
  double radius_m() const { return empty() ? 0.0 : made_->radius_m; }
  double length_m() const { return empty() ? 0.0 : made_->length_m; }

  /// Equal for copies of one stroke, and for them alone.
  const void* identity() const { return made_.get(); }
  friend bool operator==(const InkStroke& a, const InkStroke& b) {
    return a.made_ == b.made_ || (!a.empty() && !b.empty() && a.made_->points == b.made_->points);
  }

 private:
  struct Made {
    explicit Made(Points given) : points(std::move(given)) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        radius_m = std::max(radius_m, points[i].norm());
        if (i > 0) length_m += (points[i] - points[i - 1]).norm();
      }
    }
    const Points points;
    double radius_m = 0.0, length_m = 0.0;
  };
  std::shared_ptr<const Made> made_;  // null: no point
};

struct Annotation {
  std::string id;  // UUID, outlives the session
  AnnotationShape shape = AnnotationShape::kCube;
  std::string text;
  std::string author;
  double size_m = 0.05;
  std::uint32_t color_rgba = 0xffffffff;
  std::int64_t created_unix_ns = 0;
  std::uint64_t revision = 0;  // rises with each edit
  Anchor anchor;
  /// kInk: the stroke relative to the anchor, axes parallel to world [m].
  InkStroke ink_offset_m;
};

/// The order of lists: oldest first. Strict also between annotations of the same nanosecond.
inline bool CreatedBefore(const Annotation& a, const Annotation& b) {
  return a.created_unix_ns != b.created_unix_ns ? a.created_unix_ns < b.created_unix_ns
                                                : a.id < b.id;
}

/// A change of an existing annotation; what is not set stays.
struct AnnotationPatch {
  std::string id;
  std::optional<std::string> text;
  std::optional<double> size_m;
  std::optional<std::uint32_t> color_rgba;
  std::optional<AnnotationTarget> target;  // set: move it there
};

/// An anchor jumped by more than 2 cm (slam-spec section 9).
struct AnchorMoved {
  std::string id;
  Eigen::Vector3d delta_in_world = Eigen::Vector3d::Zero();  // [m]
  std::string cause;  // "map corrected", "moved by its author"
};

}  // namespace saccade
