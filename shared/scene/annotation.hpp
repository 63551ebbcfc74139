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

enum class AnnotationShape {
  kCube,
  kNote,
  kArrow,
  kInk,
  kBox,
  kMeasure,
  kPin,
  kPicture,
  kCheckList,
};
inline constexpr int kAnnotationShapes = 9;

/// "cube", "check list": how messages name it.
inline const char* ToString(AnnotationShape shape) {
  constexpr const char* kNames[kAnnotationShapes] = {
      "cube", "note", "arrow", "ink", "box", "measure", "pin", "picture", "check list"};
  return kNames[static_cast<int>(shape)];
}

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

/// One line of a check list.
struct CheckItem {
  std::string text;
  bool done = false;
  std::string done_by;  // the name of who ticked it; empty: nobody
  std::int64_t done_unix_ns = 0;

  bool operator==(const CheckItem&) const = default;
};
/// Never changed once made, so that copies of an annotation share them.
using CheckItems = std::shared_ptr<const std::vector<CheckItem>>;

/// A PNG or JPEG, checked: its size is what its header says, and it can be decoded.
struct Picture {
  std::string sha256;         // of `bytes`, 64 hexadecimal digits
  std::string media_type;     // "image/png" or "image/jpeg"
  int width = 0, height = 0;  // [px]
  std::string bytes;          // empty: with a client, which asks for them on their own
};
using PicturePtr = std::shared_ptr<const Picture>;

struct Annotation {
  std::string id;  // UUID, outlives the session
  AnnotationShape shape = AnnotationShape::kCube;
  std::string text;
  std::string author;
  std::string author_person_id;  // UUID; empty: made before persons were known
  double size_m = 0.05;
  std::uint32_t color_rgba = 0xffffffff;
  std::int64_t created_unix_ns = 0;
  std::uint64_t revision = 0;  // rises with each edit
  Anchor anchor;
  /// kInk: the stroke relative to the anchor, axes parallel to world; kMeasure: one point, its
  /// other end, which the map carries as it carries the anchor [m].
  InkStroke ink_offset_m;

  bool locked = false;    // only its author and a wearer change or delete it, or unlock it
  std::string locked_by;  // the name of who did
  std::optional<Eigen::Quaterniond> world_from_mark;   // kArrow, kBox; absent: parallel to world
  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();  // kBox: its edges along its own axes
  std::uint32_t number = 0;                            // kPin: from 1
  double length_m = 0, length_sigma_m = 0;             // kMeasure
  PicturePtr picture;                                  // kPicture; null otherwise
  CheckItems check_items;                              // kCheckList; null otherwise
};

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
  /// kInk without ink_px: the stroke relative to the target, axes parallel to world [m]. kMeasure
  /// without end_target: one point.
  InkStroke ink_offset_m;
  std::optional<AnnotationTarget> end_target;         // kMeasure
  std::optional<Eigen::Quaterniond> world_from_mark;  // kArrow, kBox; unit
  std::optional<Eigen::Vector3d> extent_m;            // kBox; absent: size_m each
  PicturePtr picture;                                 // kPicture
  std::vector<std::string> check_items;               // kCheckList
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
  std::optional<AnnotationTarget> target;      // set: move it there
  std::optional<AnnotationTarget> end_target;  // kMeasure: move its other end there
  std::optional<bool> locked;
  std::optional<Eigen::Quaterniond> world_from_mark;  // kArrow, kBox; unit
  std::optional<Eigen::Vector3d> extent_m;            // kBox
};

/// Who edits.
struct Editor {
  Editor() = default;
  /// One who is known by no more than an id.
  Editor(std::string id)  // NOLINT(google-explicit-constructor)
      : person_id(id), participant_id(std::move(id)) {}
  Editor(const char* id) : Editor(std::string(id)) {}  // NOLINT(google-explicit-constructor)

  std::string person_id;       // UUID: whose authorship and whose undo it is
  std::string participant_id;  // UUID of the session
  std::string name;            // as others see it
  bool wearer = false;         // whose locks hold nobody up
  std::string edit_group;  // edits of one session with the same one, not empty, are undone together
};

/// An anchor jumped by more than 2 cm (slam-spec section 9).
struct AnchorMoved {
  std::string id;
  Eigen::Vector3d delta_in_world = Eigen::Vector3d::Zero();  // [m]
  std::string cause;  // "map corrected", "moved by its author"
};

}  // namespace saccade
