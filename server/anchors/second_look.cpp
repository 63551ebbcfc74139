#include "server/anchors/second_look.hpp"

#include <algorithm>
#include <cmath>

#include "server/anchors/depth_probe.hpp"

namespace saccade {
namespace {

constexpr double kFirst_s = 0.3;       // after the click
constexpr double kRatio = 1.4;         // of the next look's time to this one's
constexpr double kLast_s = 8.0;        // frames last ten seconds
constexpr double kWellKnown = 0.015;   // of the range: nothing more to be learnt
constexpr double kMeansBehind = 0.15;  // at least: who clicks an outline and means what is behind

/// The clicked point at another range, its own uncertainty along the ray with it.
void SetDepth(double range_m, double sigma_m, AnchorPlace& place) {
  const Eigen::Vector3d& ray = place.look->ray;
  const Eigen::Matrix3d along = ray * ray.transpose();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along;
  place.clicked_point = place.look->origin + range_m * ray;
  place.clicked_covariance =
      (across * place.clicked_covariance * across + sigma_m * sigma_m * along).eval();
}

}  // namespace

double OutlineSigma(const DepthLayers& layers) {
  const double between = std::abs(layers.range_m - layers.other_range_m);
  const bool other_is_behind = layers.other_range_m > layers.range_m;
  const double behind = other_is_behind ? layers.other_share : 1.0 - layers.other_share;
  return std::hypot(layers.sigma_m, between * std::sqrt(std::clamp(behind, kMeansBehind, 0.5)));
}

bool LookAgain(const FrameLookup& frames, const MapSnapshot& newest, AnchorPlace& place) {
  if (!place.look) return false;
  const double age_s = Seconds(newest.capture_time_ns - place.placed_ns);
  if (age_s > kLast_s || newest.map_generation != place.map_generation) {
    place.look.reset();
    return false;
  }
  if (age_s < place.look->next_s || newest.status != TrackingStatus::kTracking) return false;
  place.look->next_s = std::max(kFirst_s, kRatio * age_s);
  const Eigen::Vector3d& ray = place.look->ray;
  const double guess = ray.dot(place.point - place.look->origin);
  const auto layers =
      ProbeLayers(place.look->past, place.look->pixel, guess, newest.frame_id, frames);
  if (!layers) return true;
  if (layers->on_outline()) {
    SetDepth(layers->nearer_m(), OutlineSigma(*layers), place);
    place.on_outline = true;
    place.seed.reset();  // half one thing, half another
    place.seed_covariance.reset();
    place.look.reset();
    return true;
  }
  double range = ray.dot(place.clicked_point - place.look->origin);
  double sigma = std::sqrt(ray.dot(place.clicked_covariance * ray));
  JoinDepth({layers->range_m, layers->sigma_m, 1.0, 0}, range, sigma);
  SetDepth(range, sigma, place);
  if (sigma < kWellKnown * range) place.look.reset();
  return true;
}

}  // namespace saccade
