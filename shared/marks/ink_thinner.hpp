#pragma once

#include <optional>
#include <vector>

#include "shared/marks/strokes.hpp"

namespace saccade {

/// Leaves out of strokes what nobody could see: those outside the view, and points nearer than half
/// a pixel to the last one kept (a hand makes several points a pixel). Where the strokes in view
/// have more than `kInkSegments` such steps together the step grows, so that a picture full of ink
/// takes no longer to draw than that.
class InkThinner {
 public:
  static constexpr double kStepPx = 0.5;
  static constexpr double kInkSegments = 5000;

  /// For one picture; `annotations` outlive nothing here.
  InkThinner(const CameraModel& camera, const Rigid3& camera_from_world,
             const std::vector<Annotation>& annotations);

  /// What is left of the stroke, in world [m]; empty if it is out of view.
  Polyline3 Thin(const Annotation& annotation) const;

  double step_px() const { return step_px_; }

 private:
  bool InView(const Eigen::Vector3d& centre_in_camera, double radius_m) const;
  /// Size of a pixel at the stroke's nearest point [m].
  double PixelM(const Annotation& annotation, const Eigen::Vector3d& centre_in_camera) const;

  const CameraModel& camera_;
  const Rigid3 camera_from_world_;
  std::optional<double> widest_rad_;  // from the optical axis to a corner; nothing: not known
  double step_px_ = kStepPx;
};

}  // namespace saccade
