#include "server/anchors/scale_chain.hpp"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {

double ScaleChain::Of(FeatureId id) const {
  const auto found = links_.find(id);
  return found == links_.end() ? now_ : found->second.variance.value_or(now_);
}

ScaleChain::Link* ScaleChain::Note(const FeatureSnapshot& feature, const MapSnapshot& snapshot,
                                   double radians_per_px) {
  if (feature.state != FeatureState::kMeasured) return nullptr;
  const Eigen::Vector3d& eye = snapshot.world_from_camera.translation;
  const auto [found, is_new] = links_.try_emplace(feature.id);
  Link& link = found->second;
  const Eigen::Vector3d line = feature.point_in_world - eye;
  if (is_new) {
    link.first_seen_from = eye;
    const double moved_rad = (eye - *began_at_).norm() / std::max(1e-12, line.norm());
    if (moved_rad < options_.least_parallax_px * radians_per_px) link.variance = 0.0;
  } else if (Seconds(snapshot.capture_time_ns - link.seen_ns) > options_.frozen_after_s) {
    link.frozen = true;
  }
  link.seen_ns = snapshot.capture_time_ns;
  if (feature.covariance_in_world.isZero(0.0)) {  // a point of the target
    link.variance = 0.0;
    link.parallax_px = options_.target_parallax_px;
  }
  const double parallax_rad =
      (link.first_seen_from - eye).cross(line).norm() / std::max(1e-12, line.squaredNorm());
  link.parallax_px = std::max(link.parallax_px, parallax_rad / radians_per_px);
  return feature.depth_known ? &link : nullptr;
}

void ScaleChain::Observe(const MapSnapshot& snapshot, double radians_per_px) {
  if (generation_ != snapshot.map_generation) {
    links_.clear();
    began_at_.reset();
    now_ = 0;
    generation_ = snapshot.map_generation;
  }
  if (snapshot.status != TrackingStatus::kTracking) return;
  if (!began_at_) began_at_ = snapshot.world_from_camera.translation;
  // What has a scale hands it on, each by how well it shows the camera's path.
  std::vector<Link*> measured;
  double weights = 0, variances = 0;
  if (links_.size() > 4000 + 2 * snapshot.features.size()) {  // what the map has dropped
    absl::flat_hash_set<FeatureId> there;
    for (const FeatureSnapshot& feature : snapshot.features) there.insert(feature.id);
    absl::erase_if(links_, [&there](const auto& link) { return !there.contains(link.first); });
  }
  links_.reserve(links_.size() + snapshot.features.size());  // what is pointed at stays
  for (const FeatureSnapshot& feature : snapshot.features) {
    Link* link = Note(feature, snapshot, radians_per_px);
    if (link == nullptr) continue;
    measured.push_back(link);
    if (!link->variance) continue;
    const double weight = std::pow(std::max(link->parallax_px, options_.least_parallax_px), 2);
    weights += weight;
    variances += weight * *link->variance;
  }
  if (measured.empty()) return;
  if (weights > 0) {
    now_ = variances / weights;
  } else {
    now_ += options_.lost_share * options_.lost_share;
  }
  for (Link* link : measured) {
    const double parallax = std::max(link->parallax_px, options_.least_parallax_px);
    const double handed = now_ + std::pow(options_.patch_error_px / parallax, 2);
    if (!link->variance || (!link->frozen && handed < *link->variance)) link->variance = handed;
  }
}

}  // namespace saccade
