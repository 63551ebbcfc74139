#include "server/tracker/lens_evidence.hpp"

#include <absl/strings/str_format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace saccade {
namespace {

constexpr double kDepthKnown = 0.3;  // sigma / inverse range, to begin with
constexpr int kFewestSeen = 12;      // in one view

/// How far a camera has turned since a view, and gone against the distance to what that saw [rad].
double StepFrom(const LensView& last, const Rigid3& world_from_camera,
                const std::map<FeatureId, Eigen::Vector3d>& points_in_world) {
  double distance_m = 0.0;
  for (const LensView::Seen& seen : last.seen) {
    distance_m += (points_in_world.at(seen.id) - last.world_from_camera.translation).norm();
  }
  distance_m /= static_cast<double>(last.seen.size());
  const double gone = (last.world_from_camera.translation - world_from_camera.translation).norm();
  return last.world_from_camera.rotation.angularDistance(world_from_camera.rotation) +
         gone / distance_m;
}

}  // namespace

void LensEvidence::Add(const CameraModel& camera, const FilterState& filter,
                       const FrameMatches& matches) {
  if (running_.valid()) {
    if (running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    Judge(running_.get());
  }
  if (matches.accepted < kFewestSeen) return;
  LensView view;
  view.world_from_camera = filter.camera().world_from_camera;
  // Asked first: most frames are no view, and what follows asks for the covariance of every match.
  if (!views_.empty() &&
      StepFrom(views_.back(), view.world_from_camera, points_in_world_) < options_.least_step_rad) {
    return;
  }
  std::map<FeatureId, Eigen::Vector3d> points;
  for (const LandmarkMatch& match : matches.in_view) {
    if (!match.accepted() || !filter.Has(match.id)) continue;
    const FeatureMarginal at = filter.Marginal(match.id);
    if (!(at.inverse_range_sigma < kDepthKnown * at.inverse_range)) continue;
    view.seen.push_back({match.id, match.pixel - match.row_shift});
    points[match.id] = at.point_in_world;
  }
  if (std::ssize(view.seen) < kFewestSeen) return;
  for (const auto& [id, point] : points) points_in_world_[id] = point;
  views_.push_back(std::move(view));
  if (std::ssize(views_) < options_.views) return;
  running_ = std::async(std::launch::async, [camera, views = views_, known = points_in_world_] {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);  // nobody waits for it
    return FitLens(camera, views, known);
  });
  views_.erase(views_.begin(), views_.begin() + options_.views / 2);
  std::erase_if(points_in_world_, [this](const auto& point) {
    return std::none_of(views_.begin(), views_.end(), [&](const LensView& each) {
      return std::any_of(each.seen.begin(), each.seen.end(),
                         [&](const LensView::Seen& seen) { return seen.id == point.first; });
    });
  });
}

void LensEvidence::Judge(const std::optional<LensFit>& fit) {
  if (!fit) return;
  const double growth = fit->stretch[1], sigma = std::sqrt(fit->covariance(1, 1));
  const bool speaks =
      std::abs(growth) > options_.least_growth && std::abs(growth) > options_.least_sigmas * sigma;
  growths_.push_back(speaks ? growth : 0.0);
  if (std::ssize(growths_) > options_.fits) growths_.pop_front();
}

void LensEvidence::ForgetViews() {
  views_.clear();
  points_in_world_.clear();
}

void LensEvidence::Wait() {
  if (running_.valid()) Judge(running_.get());
}

std::optional<double> LensEvidence::Growth() const {
  for (const double sign : {1.0, -1.0}) {
    std::vector<double> agreeing;
    for (const double growth : growths_) {
      if (growth * sign > 0.0) agreeing.push_back(growth);
    }
    if (std::ssize(agreeing) < options_.agreeing) continue;
    const auto middle = agreeing.begin() + std::ssize(agreeing) / 2;
    std::nth_element(agreeing.begin(), middle, agreeing.end());
    return *middle;
  }
  return std::nullopt;
}

std::string LensWords(double growth) {
  return absl::StrFormat(
      "The lens file does not fit: residuals grow with the radius (%+.0f %% from the centre to the "
      "corner); check model and distortion, or calibrate.",
      100.0 * growth);
}

}  // namespace saccade
