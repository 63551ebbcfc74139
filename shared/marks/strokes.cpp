#include "shared/marks/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "shared/marks/ink_thinner.hpp"

namespace saccade {
namespace {

constexpr double kAxisM = 0.1;
constexpr double kStrokeBorder_px = 32.0;  // labels are kept this far outside the picture
constexpr double kEdgeInsetPx = 26.0;      // of the tips of edge arrows
constexpr std::size_t kMaxEdgeArrows = 8;

std::string WithWarning(const std::string& words, bool hollow) {
  if (!hollow) return words;
  return words.empty() ? "do not trust" : words + ": do not trust";
}

/// Nothing if the point is in the picture.
std::optional<EdgeArrow> PointAt(const CameraModel& camera, const Annotation& annotation,
                                 const Eigen::Vector3d& in_camera) {
  const std::optional<Eigen::Vector2d> pixel = camera.Project(in_camera);
  if (pixel && camera.InImage(*pixel)) return std::nullopt;
  Eigen::Vector2d direction = in_camera.head<2>();
  // Straight behind: turn right.
  direction = direction.norm() < 1e-9 ? Eigen::Vector2d::UnitX() : direction.normalized();
  const Eigen::Vector2d middle(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  const Eigen::Vector2d reach = (middle.array() - kEdgeInsetPx).max(1.0);
  const double t = std::min(reach.x() / std::max(1e-9, std::abs(direction.x())),
                            reach.y() / std::max(1e-9, std::abs(direction.y())));
  EdgeArrow arrow;
  arrow.annotation_id = annotation.id;
  arrow.color_rgba = annotation.color_rgba;
  arrow.hollow = annotation.anchor.state == AnchorState::kPaused;
  arrow.tip_px = middle + t * direction;
  arrow.direction = direction;
  return arrow;
}

bool IsDrawable(const Annotation& annotation) {
  return annotation.anchor.state != AnchorState::kStopped && annotation.anchor.place_known &&
         annotation.anchor.point_in_world.allFinite() && std::isfinite(annotation.size_m);
}

}  // namespace

Marks AnnotationMarks(const CameraModel& camera, const Rigid3& world_from_camera,
                      const std::vector<Annotation>& annotations, bool metric) {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  const InkThinner thinner(camera, camera_from_world, annotations);
  Marks marks;
  for (const Annotation& annotation : annotations) {
    if (!IsDrawable(annotation)) continue;
    const bool hollow = annotation.anchor.state == AnchorState::kPaused;
    const bool ink = annotation.shape == AnnotationShape::kInk;
    for (const Polyline3& line : ink ? std::vector<Polyline3>{thinner.Thin(annotation)}
                                     : ShapeLines(annotation, world_from_camera)) {
      for (Polyline2& piece : ProjectPolyline(camera, camera_from_world, line)) {
        marks.strokes.push_back({annotation.id, annotation.color_rgba, hollow, std::move(piece)});
      }
    }
    const Eigen::Vector3d in_camera = camera_from_world * annotation.anchor.point_in_world;
    if (!in_camera.allFinite()) continue;
    if (std::optional<EdgeArrow> arrow = PointAt(camera, annotation, in_camera);
        arrow && marks.edge_arrows.size() < kMaxEdgeArrows) {
      marks.edge_arrows.push_back(*std::move(arrow));
    }
    const std::optional<Eigen::Vector2d> at =
        camera.Project(camera_from_world * LabelPoint(annotation, world_from_camera));
    if (!at || !camera.InImage(*at, -kStrokeBorder_px)) continue;
    const std::string words = LabelWords(annotation, metric);
    const std::string text = WithWarning(words, hollow);
    if (!text.empty()) {
      marks.labels.push_back({annotation.id, words, text, annotation.color_rgba, hollow, *at});
    }
  }
  return marks;
}

std::array<AxisStroke, 3> WorldAxes(const CameraModel& camera, const Rigid3& world_from_camera) {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  std::array<AxisStroke, 3> axes;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d tip = kAxisM * Eigen::Vector3d::Unit(i);
    axes[i].name = "xyz"[i];
    axes[i].pieces = ProjectPolyline(camera, camera_from_world, {Eigen::Vector3d::Zero(), tip});
    axes[i].end_px = camera.Project(camera_from_world * tip);
  }
  return axes;
}

}  // namespace saccade
