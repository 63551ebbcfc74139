#include "shared/marks/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "shared/marks/ink_thinner.hpp"

namespace saccade {
namespace {

constexpr double kAxisM = 0.1;
constexpr double kBorderPx = 32.0;     // labels are kept this far outside the picture
constexpr double kEdgeInsetPx = 26.0;  // of the tips of edge arrows
constexpr std::size_t kMaxEdgeArrows = 8;

std::vector<Polyline3> CubeLines(const Eigen::Vector3d& centre, double size_m) {
  const double h = 0.5 * size_m;
  const auto corner = [&](int i) -> Eigen::Vector3d {
    return centre + Eigen::Vector3d(i & 1 ? h : -h, i & 2 ? h : -h, i & 4 ? h : -h);
  };
  std::vector<Polyline3> lines;
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      if (!(i & bit)) lines.push_back({corner(i), corner(i | bit)});
    }
  }
  return lines;
}

std::vector<Polyline3> ArrowLines(const Eigen::Vector3d& tip, double size_m) {
  const auto up = [&tip](double dx, double dy, double dz) -> Eigen::Vector3d {
    return tip + Eigen::Vector3d(dx, -dy, dz);
  };
  const double head = 0.4 * size_m;
  const double half = 0.5 * head;
  return {{up(0, 2 * size_m, 0), tip},
          {up(-half, head, 0), tip, up(half, head, 0)},
          {up(0, head, -half), tip, up(0, head, half)}};
}

/// A note stands on a pin, one size above its anchor (world y points down).
Eigen::Vector3d NoteTop(const Annotation& annotation) {
  return annotation.anchor.point_in_world - Eigen::Vector3d(0, annotation.size_m, 0);
}

std::string Words(const Annotation& annotation) {
  const bool nameless = annotation.shape == AnnotationShape::kNote && annotation.text.empty();
  return nameless ? "note" : annotation.text;
}

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

std::vector<Polyline3> ShapeLines(const Annotation& annotation) {
  const Eigen::Vector3d& point = annotation.anchor.point_in_world;
  switch (annotation.shape) {
    case AnnotationShape::kCube:
      return CubeLines(point, annotation.size_m);
    case AnnotationShape::kNote:
      return {{point, NoteTop(annotation)}};
    case AnnotationShape::kArrow:
      return ArrowLines(point, annotation.size_m);
    case AnnotationShape::kInk:
      break;
  }
  Polyline3 line;
  for (const Eigen::Vector3d& offset : annotation.ink_offset_m) line.push_back(point + offset);
  return {line};
}

Marks AnnotationMarks(const CameraModel& camera, const Rigid3& world_from_camera,
                      const std::vector<Annotation>& annotations) {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  const InkThinner thinner(camera, camera_from_world, annotations);
  Marks marks;
  for (const Annotation& annotation : annotations) {
    if (!IsDrawable(annotation)) continue;
    const bool hollow = annotation.anchor.state == AnchorState::kPaused;
    const bool ink = annotation.shape == AnnotationShape::kInk;
    for (const Polyline3& line :
         ink ? std::vector<Polyline3>{thinner.Thin(annotation)} : ShapeLines(annotation)) {
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
    const Eigen::Vector3d label_at = annotation.shape == AnnotationShape::kNote
                                         ? camera_from_world * NoteTop(annotation)
                                         : in_camera;
    const std::optional<Eigen::Vector2d> at = camera.Project(label_at);
    if (!at || !camera.InImage(*at, -kBorderPx)) continue;
    const std::string words = Words(annotation);
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
