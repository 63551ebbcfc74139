// Squares of unknown place: what a metre is by them, and where they are.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/tracker/square_landmarks.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr double kMetreSigma = 0.02;     // relative, of what a metre is
constexpr double kSizeSigmas = 4.0;      // by which a square of another size must stand out
constexpr double kMostSizeSigma = 0.03;  // relative; a square that tells less is not judged
// A place is told to the filter loosely: it comes from the same pictures.
constexpr double kPlaceShare = 0.1;  // of the distance
constexpr double kPlaceAngle_rad = 0.2;

/// What one square says that a metre is.
struct Metre {
  std::pair<std::string, int> square;
  double log_metre, sigma;

  bool Agrees(double log_other) const {
    return std::abs(log_metre - log_other) < std::max(SquareDoubts::kLeastOff, kSizeSigmas * sigma);
  }
};

/// The value with half of the weight on either side.
double WeightedMedian(std::vector<Metre> metres) {
  std::sort(metres.begin(), metres.end(),
            [](const Metre& a, const Metre& b) { return a.log_metre < b.log_metre; });
  double all = 0.0, below = 0.0;
  for (const Metre& one : metres) all += 1.0 / (one.sigma * one.sigma);
  for (const Metre& one : metres) {
    below += 1.0 / (one.sigma * one.sigma);
    if (below >= 0.5 * all) return one.log_metre;
  }
  return 0.0;
}

}  // namespace

std::optional<double> SquareLandmarks::FindMetre(const CameraModel& camera) {
  MarkerFitOptions options;
  options.metric = false;
  std::vector<Metre> metres;
  for (const auto& [key, views] : views_) {
    const auto fit = FitMarker(camera, PosedViews(views), options_.size_m, options);
    if (!fit || !(fit->log_metre_sigma > 0.0)) continue;
    metres.push_back({key, std::log(fit->metre), fit->log_metre_sigma});
  }
  // Two that disagree do not tell which is wrong; of more, the few are.
  const double middle = WeightedMedian(metres);
  double information = 0.0, sum = 0.0;
  for (const Metre& one : metres) {
    if (metres.size() > 2 && one.sigma < kMostSizeSigma && !one.Agrees(middle)) {
      doubts_.AddSize(one.square.first, one.square.second, options_.size_m,
                      std::exp(one.log_metre - middle));
      continue;
    }
    const double weight = 1.0 / (one.sigma * one.sigma);
    information += weight;
    sum += weight * one.log_metre;
  }
  if (metres.size() == 2 && std::max(metres[0].sigma, metres[1].sigma) < kMostSizeSigma &&
      !metres[0].Agrees(metres[1].log_metre)) {
    doubts_.AddDisagreement(metres[0].square.first, metres[0].square.second,
                            metres[1].square.second,
                            std::exp(metres[0].log_metre - metres[1].log_metre));
  }
  for (const std::string& words : doubts_.Take()) Log(absl::StrCat("landmarks: ", words));
  if (!(information > 1.0 / (kMetreSigma * kMetreSigma))) return std::nullopt;
  return std::exp(sum / information);
}

bool SquareLandmarks::HasItsSize(const CameraModel& camera, const Key& key) {
  MarkerFitOptions options;
  options.metric = false;
  const auto fit = FitMarker(camera, PosedViews(views_[key]), options_.size_m, options);
  if (!fit || !(fit->log_metre_sigma > 0.0) || fit->log_metre_sigma > kMostSizeSigma) return true;
  const Metre metre{key, std::log(fit->metre), fit->log_metre_sigma};
  if (metre.Agrees(0.0)) return true;
  doubts_.AddSize(key.first, key.second, options_.size_m, fit->metre);
  for (const std::string& words : doubts_.Take()) Log(absl::StrCat("landmarks: ", words));
  misprinted_.insert(key);
  views_.erase(key);
  return false;
}

void SquareLandmarks::Place(const CameraModel& camera, int most, FilterState& filter) {
  std::vector<Key> order;
  for (const auto& [key, views] : views_) order.push_back(key);
  std::ranges::rotate(order, std::ranges::upper_bound(order, last_tried_));
  if (order.size() > static_cast<std::size_t>(most)) order.resize(static_cast<std::size_t>(most));
  for (const Key& key : order) {
    last_tried_ = key;
    const auto fit =
        FitMarker(camera, PosedViews(views_[key]), options_.size_m, MarkerFitOptions());
    if (!fit || !HasItsSize(camera, key)) continue;
    const double distance =
        (fit->world_from_marker.translation - filter.camera().world_from_camera.translation).norm();
    Matrix6d covariance = fit->covariance;
    covariance.diagonal().head<3>().array() += std::pow(kPlaceShare * distance, 2);
    covariance.diagonal().tail<3>().array() += kPlaceAngle_rad * kPlaceAngle_rad;
    mapped_[key] = {filter.AddMarker(fit->world_from_marker, covariance), options_.size_m};
    views_.erase(key);
  }
}

}  // namespace saccade
