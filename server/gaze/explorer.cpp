#include "server/gaze/explorer.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr std::size_t kMostCandidates = 300;
constexpr double kSurroundings_m = 0.3;
constexpr std::size_t kRemembered = 6;
constexpr double kNearest_m = 0.2;
constexpr std::size_t kFewest = 3;  // of features round a place: a stray one is no place

/// Sigma along the worst axis per distance.
double RelativeSigma(const FeatureSnapshot& feature, double distance) {
  return std::min(1.0, std::sqrt(std::max(0.0, feature.covariance_in_world.trace())) / distance);
}

}  // namespace

std::optional<Eigen::Vector3d> Explorer::Choose(const MapSnapshot& map,
                                                const Rigid3& world_from_mount,
                                                const MountModel& mount) {
  const Rigid3 mount_from_world = world_from_mount.Inverse();
  std::optional<Eigen::Vector3d> best;
  double best_score = -1;
  // Of a large map every so many-th: each is compared with all others.
  const std::size_t stride = 1 + map.features.size() / kMostCandidates;
  for (std::size_t k = 0; k < map.features.size(); k += stride) {
    const FeatureSnapshot& feature = map.features[k];
    const Eigen::Vector3d point = feature.point_in_world;
    if (!point.allFinite() || (mount_from_world * point).norm() < kNearest_m) continue;
    double score = 0;
    std::size_t around = 0;
    for (const FeatureSnapshot& other : map.features) {
      if ((other.point_in_world - point).norm() > kSurroundings_m) continue;
      score += RelativeSigma(other, (mount_from_world * other.point_in_world).norm() + 1e-3);
      ++around;
    }
    if (around < std::min(kFewest, map.features.size())) continue;
    score /= static_cast<double>(around);
    for (const Eigen::Vector3d& seen : recent_) {
      if ((seen - point).norm() < 2 * kSurroundings_m) score *= 0.1;
    }
    if (score <= best_score) continue;
    if (!mount.Fixate(mount_from_world * point, std::nullopt, {}).reachable) continue;
    best_score = score;
    best = point;
  }
  if (best) recent_.push_back(*best);
  if (recent_.size() > kRemembered) recent_.pop_front();
  return best;
}

}  // namespace saccade
