#include "server/anchors/pointer_placer.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "server/anchors/click.hpp"

namespace saccade {
namespace {

constexpr std::size_t kKeptFrames = 4;

/// The point's own field, in place of what a click calls it.
absl::Status Named(std::size_t i, const absl::Status& status) {
  absl::string_view words = status.message();
  const std::string field = absl::StrCat("points[", i, "]");
  if (absl::ConsumePrefix(&words, "target")) {
    return absl::Status(status.code(), absl::StrCat(field, words));
  }
  return absl::Status(status.code(), absl::StrCat(field, ": ", words));
}

/// Where a line of sight meets the surface, as ink drawn there would.
Eigen::Vector3d OnSurface(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                          const StrokeSurface& surface) {
  const double depth_m = (surface.point_in_world - origin).norm();
  const double cosine = ray.dot(surface.normal_in_world);
  const double t = (surface.point_in_world - origin).dot(surface.normal_in_world) / cosine;
  const bool hits = std::abs(cosine) > 0.1 && t > 0.5 * depth_m && t < 2.0 * depth_m;
  return origin + (hits ? t : depth_m) * ray;
}

}  // namespace

void PointerPlacer::OnSnapshot(std::shared_ptr<const MapSnapshot> snapshot,
                               std::shared_ptr<const SurfaceSnapshot> surface) {
  auto view =
      std::make_shared<const MapView>(std::move(snapshot), nullptr, nullptr, std::move(surface));
  const std::lock_guard lock(mutex_);
  if (newest_ && view->snapshot().frame_id < newest_->snapshot().frame_id) found_.clear();
  newest_ = std::move(view);  // a source that started again gives ids anew
}

absl::StatusOr<std::shared_ptr<const MapView>> PointerPlacer::Newest() const {
  const std::lock_guard lock(mutex_);
  if (newest_) return newest_;
  return absl::FailedPreconditionError("points: no frame has been tracked yet; wait for video");
}

absl::StatusOr<PastFrame> PointerPlacer::Find(FrameId id) const {
  {
    const std::lock_guard lock(mutex_);
    for (const PastFrame& one : found_) {
      if (one.frame->id == id) return one;
    }
  }
  absl::StatusOr<PastFrame> past = frames_(id);
  if (!past.ok()) return past;
  const std::lock_guard lock(mutex_);
  found_.push_back({past->frame, past->snapshot});
  if (found_.size() > kKeptFrames) found_.pop_front();
  return past;
}

absl::StatusOr<std::vector<Eigen::Vector3d>> PointerPlacer::Locate(
    absl::Span<const AnnotationTarget> points) const {
  const absl::StatusOr<std::shared_ptr<const MapView>> newest = Newest();
  if (!newest.ok()) return newest.status();
  const FrameLookup frames = [this](FrameId id) { return Find(id); };
  std::vector<Eigen::Vector3d> located;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const absl::StatusOr<ResolvedTarget> resolved =
        ResolveTarget(points[i], frames, **newest, options_, ClickCare::kLight);
    if (!resolved.ok()) return Named(i, resolved.status());
    located.push_back(resolved->point_in_world);
  }
  return located;
}

absl::StatusOr<std::vector<Eigen::Vector3d>> PointerPlacer::Trace(
    absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>& surface) const {
  const absl::StatusOr<std::shared_ptr<const MapView>> newest = Newest();
  if (!newest.ok()) return newest.status();
  const FrameLookup frames = [this](FrameId id) { return Find(id); };
  std::vector<Eigen::Vector3d> located;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!surface) {
      const absl::StatusOr<ResolvedTarget> resolved =
          ResolveTarget(points[i], frames, **newest, options_, ClickCare::kLight);
      if (!resolved.ok()) return Named(i, resolved.status());
      const Eigen::Vector3d& point = resolved->point_in_world;
      surface = StrokeSurface{point, resolved->normal_in_world};
      if (surface->normal_in_world.isZero(0.0)) {  // facing the camera
        const Eigen::Vector3d camera = (*newest)->snapshot().world_from_camera.translation;
        surface->normal_in_world = (camera - point).normalized();
      }
      located.push_back(point);
    } else if (const auto* pixel = std::get_if<PixelTarget>(&points[i])) {
      const absl::StatusOr<PixelRay> cast = CastPixel(*pixel, frames, **newest);
      if (!cast.ok()) return Named(i, cast.status());
      located.push_back(
          OnSurface(cast->world_from_camera.translation, cast->ray_in_world, *surface));
    } else if (const auto* ray = std::get_if<RayTarget>(&points[i])) {
      located.push_back(
          OnSurface(ray->origin_in_world, ray->direction_in_world.normalized(), *surface));
    } else {
      const absl::StatusOr<ResolvedTarget> resolved =
          ResolveTarget(points[i], frames, **newest, options_, ClickCare::kLight);
      if (!resolved.ok()) return Named(i, resolved.status());
      located.push_back(resolved->point_in_world);
    }
  }
  return located;
}

}  // namespace saccade
