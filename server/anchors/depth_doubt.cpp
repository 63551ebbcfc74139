#include "server/anchors/depth_doubt.hpp"

#include <algorithm>
#include <cmath>

#include "server/anchors/depth_probe.hpp"

namespace saccade {
namespace {

constexpr double kClutter = 0.4;         // of the way to the nearest thing that is known
constexpr double kRelief_px = 12.0;      // a patch is 15 px wide: what it shows beside the click
constexpr double kFloor = 0.003;         // of the range: patches are off by so much themselves
constexpr double kWindowReach_px = 4.5;  // a window shows the depth of what is nearer than this
constexpr double kOtherShare = 0.3;      // that the other of two depths was meant
constexpr double kReach_px = 5.0;        // a window this near to an outline shows both sides of it
constexpr double kAgree = 2.0;           // sigma
constexpr double kLeastShare = 0.15;     // that the other surface was meant
constexpr double kFirst_s = 0.5;         // after the click
constexpr double kRatio = 2.0;           // of the next look's time to this one's
constexpr double kLast_s = 8.0;          // frames last ten seconds

/// Takes over what the picture shows.
void Learn(const DepthLayers& layers, DepthDoubt& doubt) {
  if (!layers.on_outline() || layers.other_from_px > kReach_px) {
    doubt.seen_m = layers.range_m;
    doubt.seen_sigma_m = layers.sigma_m;
    if (layers.reach_px > kWindowReach_px) doubt.surface = ClickSurface::kOne;
    return;
  }
  doubt.surface = ClickSurface::kOutline;
  const double between_m = std::abs(layers.range_m - layers.other_range_m);
  doubt.outline_sigma_m = between_m * std::sqrt(std::clamp(layers.other_share, kLeastShare, 0.5));
}

}  // namespace

double DepthDoubt::Sigma(double range_m, bool measured) const {
  if (surface == ClickSurface::kOutline) return outline_sigma_m;
  const double off_m = std::abs(range_m - seen_m);
  const bool contradicted = seen_m > 0 && off_m > kAgree * seen_sigma_m;
  const double open_m = surface == ClickSurface::kOne ? floor_sigma_m
                        : measured || seen_m > 0      ? relief_sigma_m
                                                      : clutter_sigma_m;
  return contradicted ? std::max(open_m, off_m) : open_m;
}

DepthDoubt AskThePicture(const PastFrame& past, const Eigen::Vector2d& pixel, FrameId newest,
                         const FrameLookup& frames, const PoseTrail* trail, SurfaceDepth& depth) {
  const double radians_per_px = past.frame->camera->RadiansPerPixel();
  DepthDoubt doubt;
  doubt.clutter_sigma_m = kClutter * depth.nearest_rad * depth.depth_m;
  doubt.floor_sigma_m = kFloor * depth.depth_m;
  doubt.relief_sigma_m = kRelief_px * radians_per_px * depth.depth_m;
  if (!depth.at_feature) {
    if (const auto probed = ProbeDepth(past, pixel, depth.depth_m, newest, frames, trail)) {
      const double apart_m = std::abs(probed->range_m - depth.depth_m);
      const bool contradicts = apart_m > std::hypot(probed->sigma_m, depth.sigma_m);
      JoinDepth(*probed, depth.depth_m, depth.sigma_m);
      if (contradicts) {  // two depths are seen about the click
        doubt.relief_sigma_m = std::hypot(doubt.relief_sigma_m, kOtherShare * apart_m);
      }
      doubt.clutter_sigma_m = doubt.relief_sigma_m;
    }
  }
  if (const auto layers = ProbeLayers(past, pixel, depth.depth_m, newest, frames, trail)) {
    Learn(*layers, doubt);
  }
  return doubt;
}

bool LookAgain(const FrameLookup& frames, const PoseTrail* trail, const MapSnapshot& newest,
               double age_s, std::optional<ClickLook>& look, DepthDoubt& doubt) {
  if (!look) return false;
  if (age_s < look->next_s || newest.status != TrackingStatus::kTracking) return false;
  const absl::StatusOr<PastFrame> past = frames(look->frame_id);
  if (age_s > kLast_s || !past.ok() || past->snapshot->map_generation != newest.map_generation) {
    look.reset();
    return false;
  }
  look->next_s = std::max(kFirst_s, kRatio * age_s);
  const auto layers =
      ProbeLayers(*past, look->pixel, look->range_m, newest.frame_id, frames, trail);
  if (!layers) return true;
  Learn(*layers, doubt);
  if (doubt.surface != ClickSurface::kUnknown) look.reset();
  return true;
}

}  // namespace saccade
