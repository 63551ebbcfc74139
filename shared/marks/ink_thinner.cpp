#include "shared/marks/ink_thinner.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace saccade {
namespace {

constexpr double kBorderPx = 32.0;  // lines are drawn that far outside the picture
constexpr double kNearM = 0.02;

/// Angle between the optical axis and the farthest corner of the picture with its border.
std::optional<double> WidestAngle(const CameraModel& camera) {
  double widest = 0.0;
  const double right = camera.width() - 1 + kBorderPx, bottom = camera.height() - 1 + kBorderPx;
  for (const double u : {-kBorderPx, right}) {
    for (const double v : {-kBorderPx, bottom}) {
      const std::optional<Eigen::Vector3d> bearing = camera.Unproject({u, v});
      if (!bearing || !bearing->allFinite()) return std::nullopt;  // the lens ends before
      widest = std::max(widest, std::atan2(bearing->head<2>().norm(), bearing->z()));
    }
  }
  return widest;
}

}  // namespace

InkThinner::InkThinner(const CameraModel& camera, const Rigid3& camera_from_world,
                       const std::vector<Annotation>& annotations)
    : camera_(camera), camera_from_world_(camera_from_world), widest_rad_(WidestAngle(camera)) {
  double total_px = 0.0;
  for (const Annotation& annotation : annotations) {
    const InkStroke& ink = annotation.ink_offset_m;
    if (ink.empty()) continue;
    const Eigen::Vector3d centre = camera_from_world_ * annotation.anchor.point_in_world;
    if (!InView(centre, ink.radius_m())) continue;
    const double pixel_m = PixelM(annotation, centre);
    // Never more steps than it has points.
    const double px = std::min(ink.length_m() / pixel_m, kStepPx * static_cast<double>(ink.size()));
    if (std::isfinite(px)) total_px += px;
  }
  step_px_ = std::max(kStepPx, total_px / kInkSegments);
}

bool InkThinner::InView(const Eigen::Vector3d& centre_in_camera, double radius_m) const {
  const double distance_m = centre_in_camera.norm();
  if (!widest_rad_ || !(distance_m > radius_m)) return true;  // round the camera, or not a number
  const double off_axis = std::atan2(centre_in_camera.head<2>().norm(), centre_in_camera.z());
  return off_axis - std::asin(radius_m / distance_m) < *widest_rad_;
}

double InkThinner::PixelM(const Annotation& annotation,
                          const Eigen::Vector3d& centre_in_camera) const {
  const double nearest_m = centre_in_camera.norm() - annotation.ink_offset_m.radius_m();
  return camera_.RadiansPerPixel() * std::max(kNearM, nearest_m);
}

Polyline3 InkThinner::Thin(const Annotation& annotation) const {
  const InkStroke& ink = annotation.ink_offset_m;
  const Eigen::Vector3d& point = annotation.anchor.point_in_world;
  const Eigen::Vector3d centre = camera_from_world_ * point;
  Polyline3 line;
  if (ink.empty() || !InView(centre, ink.radius_m())) return line;
  const double step_m = step_px_ * PixelM(annotation, centre);
  const double step_m2 = step_m * step_m;
  const Eigen::Vector3d* kept = nullptr;
  for (const Eigen::Vector3d& offset : ink) {
    const bool last = &offset == ink.end() - 1;
    // Not >=: what is not a number is kept, and leaves a gap.
    if (kept && !last && (offset - *kept).squaredNorm() < step_m2) continue;
    line.push_back(point + offset);
    kept = &offset;
  }
  return line;
}

}  // namespace saccade
