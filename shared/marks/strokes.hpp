#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/marks/shape_lines.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

using Polyline2 = std::vector<Eigen::Vector2d>;  // [px, distorted]

/// A polyline of one annotation as it appears through the lens.
struct Stroke {
  std::string annotation_id;
  std::uint32_t color_rgba = 0xffffffff;
  bool hollow = false;  // "do not trust": drawn dashed
  Polyline2 points_px;
};

/// A text beside a point.
struct Label {
  std::string annotation_id;
  std::string words;  // all of the annotation's text; "note" for a note without
  std::string text;   // the same, and the words "do not trust" where it is hollow
  std::uint32_t color_rgba = 0xffffffff;
  bool hollow = false;
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
};

/// A mark outside the view: where on the picture's edge to point, and whither.
struct EdgeArrow {
  std::string annotation_id;
  std::uint32_t color_rgba = 0xffffffff;
  bool hollow = false;
  Eigen::Vector2d tip_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  // unit
};

struct Marks {
  std::vector<Stroke> strokes;
  std::vector<Label> labels;
  std::vector<EdgeArrow> edge_arrows;
};

/// One world axis, 10 cm long.
struct AxisStroke {
  char name = 'x';
  std::vector<Polyline2> pieces;
  std::optional<Eigen::Vector2d> end_px;
};

/// Marks of the annotations in a view: exact definitions in docs/design/overlay.md and
/// marks.md, which the page follows too. `metric`: the map has metres, which lengths are told in.
/// Stopped annotations and those whose place is not known have none. Points behind the camera, not
/// finite or beyond the lens leave gaps, never NaN.
Marks AnnotationMarks(const CameraModel& camera, const Rigid3& world_from_camera,
                      const std::vector<Annotation>& annotations, bool metric = true);

/// The world's axes at its origin.
std::array<AxisStroke, 3> WorldAxes(const CameraModel& camera, const Rigid3& world_from_camera);

/// A polyline in world as it appears through the lens: cut at the near plane (2 cm), divided until
/// no piece bends by more than 0.25 px (at most 256 pieces), cut where it is more than 32 px
/// outside the picture.
std::vector<Polyline2> ProjectPolyline(const CameraModel& camera, const Rigid3& camera_from_world,
                                       const Polyline3& points_in_world);

}  // namespace saccade
