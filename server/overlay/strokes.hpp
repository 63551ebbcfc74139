#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// What a stroke belongs to; the page uses the same names.
enum class StrokeKind {
  kCube,
  kNotePin,
  kNoteBox,
  kArrow,
  kInk,
  kAxisX,
  kAxisY,
  kAxisZ,
  kEdgeArrow
};

/// A polyline in distorted pixels, already cut at the near plane and at the picture's border.
struct Stroke {
  StrokeKind kind = StrokeKind::kCube;
  std::string annotation_id;  // empty for axes
  std::uint32_t color_rgba = 0xffffffff;
  bool dashed = false;         // "do not trust": paused
  bool closed_filled = false;  // note boxes and edge arrows
  std::vector<Eigen::Vector2d> points_px;
};

/// A text with the left end of its base line.
struct Label {
  std::string annotation_id;
  std::string text;  // one line, at most 40 characters
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  bool do_not_trust = false;
};

struct Strokes {
  std::vector<Stroke> strokes;
  std::vector<Label> labels;
};

/// Strokes of the annotations in a view: exact definitions in server/overlay/README.md, which the
/// page follows too. Points behind the camera, not finite or beyond the lens leave gaps, never NaN.
Strokes AnnotationStrokes(const CameraModel& camera, const Rigid3& world_from_camera,
                          const std::vector<Annotation>& annotations);

/// The three world axes, 10 cm long, at the world's origin.
Strokes WorldAxisStrokes(const CameraModel& camera, const Rigid3& world_from_camera);

/// A polyline in world as it appears through the lens: cut at the near plane (2 cm), divided until
/// no piece bends by more than 0.25 px, clipped to the picture with a border of 32 px.
std::vector<std::vector<Eigen::Vector2d>> ProjectPolyline(
    const CameraModel& camera, const Rigid3& camera_from_world,
    const std::vector<Eigen::Vector3d>& points_in_world);

}  // namespace saccade
