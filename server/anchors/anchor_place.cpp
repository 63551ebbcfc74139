#include "server/anchors/anchor_place.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/anchors/anchor_claim.hpp"
#include "server/anchors/rigid_fit.hpp"

namespace saccade {
namespace {

constexpr Timestamp kReselectNs = 2'000'000'000;   // a better cluster is looked for this often
constexpr double kSettled_s = 5.0;                 // seen for so long, its company stays
constexpr double kLongestStep_s = 0.1;             // between frames; what is longer is a gap
constexpr std::uint32_t kMinMatches = 3;           // before a seeded feature says anything
constexpr std::uint32_t kManyMatches = 20;         // before it may overrule the click's own depth
constexpr Timestamp kSeedGraceNs = 1'000'000'000;  // a seeded feature is in the map by then
constexpr double kConsistentChi2 = 16.0;

struct Candidate {
  const FeatureSnapshot* feature = nullptr;
  double weight = 0;
  double distance_m = 0;
};

double Softening(const MapView& map, const AnchorOptions& options, const AnchorPlace& place) {
  return map.snapshot().metric ? options.cluster_softening_m : 0.07 * place.distance_m;
}

/// True if the fit's rotation, on an arm as long as the cluster's centre is away from the anchor,
/// would add more noise than its translation: the cluster is then too tight for its distance.
bool NeedsMoreSpread(const std::vector<Candidate>& cluster, const Eigen::Vector3d& point) {
  double total = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Candidate& c : cluster) {
    total += c.weight;
    mean += c.weight * c.feature->point_in_world;
  }
  mean /= total;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Candidate& c : cluster) {
    const Eigen::Vector3d d = c.feature->point_in_world - mean;
    scatter += c.weight / total * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()(1) < (mean - point).squaredNorm();
}

/// The k nearest features with known depth, up to 2 k where the nearest are too tight.
std::vector<Candidate> SelectCluster(const MapView& map, const AnchorOptions& options,
                                     const AnchorPlace& place, const Eigen::Vector3d& point) {
  const double softening = Softening(map, options, place);
  std::vector<Candidate> candidates;
  for (const FeatureSnapshot& feature : map.snapshot().features) {
    if (!feature.depth_known || map.Find(feature.id) != &feature) continue;
    Candidate candidate{&feature, 0, (feature.point_in_world - point).norm()};
    const double sigma2 = feature.covariance_in_world.trace() / 3.0 + 1e-8;
    candidate.weight = 1.0 / (sigma2 * (std::pow(candidate.distance_m, 2) + softening * softening));
    if (std::isfinite(candidate.weight)) candidates.push_back(candidate);
  }
  const auto nearer = [](const Candidate& a, const Candidate& b) {
    return a.distance_m < b.distance_m;
  };
  const std::size_t most = std::min<std::size_t>(2 * options.cluster_size, candidates.size());
  std::partial_sort(candidates.begin(), candidates.begin() + most, candidates.end(), nearer);
  std::size_t count = std::min<std::size_t>(options.cluster_size, most);
  std::vector<Candidate> cluster(candidates.begin(), candidates.begin() + count);
  while (count < most && NeedsMoreSpread(cluster, point)) cluster.push_back(candidates[count++]);
  return cluster;
}

Rigid3 FitMembers(const MapView& map, const AnchorPlace& place) {
  if (place.members.empty()) return place.world_from_binding;
  std::vector<WeightedPair> pairs;
  pairs.reserve(place.members.size());
  for (const ClusterMember& member : place.members) {
    pairs.push_back({member.at_binding, map.Find(member.id)->point_in_world, member.weight});
  }
  return FitRigid(pairs);
}

/// Expresses the place in a new binding so that the world sees no difference.
void ChangeBinding(const Rigid3& new_from_old, AnchorPlace& place) {
  const Eigen::Matrix3d r = new_from_old.RotationMatrix();
  place.point = new_from_old * place.point;
  place.clicked_point = new_from_old * place.clicked_point;
  place.clicked_covariance = (r * place.clicked_covariance * r.transpose()).eval();
  if (place.seed_covariance) {
    place.seed_covariance = (r * *place.seed_covariance * r.transpose()).eval();
  }
  place.doubt_ray = r * place.doubt_ray;
  place.clicked_from = new_from_old * place.clicked_from;
}

/// Drops members that the map no longer holds; the fit of the others, one frame ago, is made to
/// agree with where the anchor was drawn then.
void DropLostMembers(const MapView& map, AnchorPlace& place) {
  const auto lost = [&map](const ClusterMember& member) { return map.Find(member.id) == nullptr; };
  if (std::none_of(place.members.begin(), place.members.end(), lost)) return;
  std::erase_if(place.members, lost);
  if (place.members.empty()) return;
  std::vector<WeightedPair> pairs;
  for (const ClusterMember& member : place.members) {
    pairs.push_back({member.at_binding, member.last_in_world, member.weight});
  }
  const Rigid3 world_before_from_binding = FitRigid(pairs);
  ChangeBinding(world_before_from_binding.Inverse() * place.world_from_binding, place);
  place.world_from_binding = world_before_from_binding;
}

/// Whether the camera looks there now.
bool IsSeen(const MapView& map, const AnchorPlace& place) {
  return std::any_of(place.members.begin(), place.members.end(), [&map](const auto& member) {
    return map.Find(member.id)->state == FeatureState::kMeasured;
  });
}

/// Adds the features that carry the anchor best now. New members enter with no residual, so nothing
/// moves in this frame.
void Replenish(const MapView& map, const AnchorOptions& options, AnchorPlace& place,
               int& selections_left) {
  const Timestamp now_ns = map.snapshot().capture_time_ns;
  const bool full = place.members.size() >= static_cast<std::size_t>(options.cluster_size);
  // Members stay in the map when they leave the filter: choices out of sight, or later ones, would
  // only take over what the map is wrong by at that moment.
  const bool settled = place.was_sure && (place.seen_s > kSettled_s || !IsSeen(map, place));
  if (full && (settled || selections_left <= 0 ||
               std::abs(now_ns - place.last_selected_ns) < kReselectNs)) {
    return;
  }
  --selections_left;
  place.last_selected_ns = now_ns;
  const Rigid3 binding_from_world = place.world_from_binding.Inverse();
  bool changed = false;
  for (const Candidate& candidate :
       SelectCluster(map, options, place, place.world_from_binding * place.point)) {
    const FeatureId id = candidate.feature->id;
    const auto same = [id](const ClusterMember& member) { return member.id == id; };
    if (std::any_of(place.members.begin(), place.members.end(), same)) continue;
    const Eigen::Vector3d at = binding_from_world * candidate.feature->point_in_world;
    place.members.push_back({id, candidate.weight, at, candidate.feature->point_in_world});
    changed = true;
  }
  if (!changed) return;
  const std::size_t most = 2 * static_cast<std::size_t>(options.cluster_size);
  if (place.members.size() > most) {
    std::partial_sort(place.members.begin(), place.members.begin() + most, place.members.end(),
                      [](const auto& a, const auto& b) { return a.weight > b.weight; });
    place.members.resize(most);
  }
  const Rigid3 fitted = FitMembers(map, place);
  ChangeBinding(fitted.Inverse() * place.world_from_binding, place);
  place.world_from_binding = fitted;
}

/// What the cluster says about the anchor, the click's own uncertainty included.
PlaceEstimate FromCluster(const MapView& map, const AnchorPlace& place) {
  const MapSnapshot& snapshot = map.snapshot();
  PlaceEstimate estimate;
  estimate.point_in_world = place.world_from_binding * place.clicked_point;
  double total = 0, at_rest = 0, turn_variance = 0;
  for (const ClusterMember& member : place.members) {
    const FeatureSnapshot& feature = *map.Find(member.id);
    estimate.covariance_in_world += member.weight * feature.covariance_in_world;
    estimate.covariance_in_camera += member.weight * feature.covariance_in_camera;
    total += member.weight;
    if (IsAtRest(feature)) {
      at_rest += member.weight;
      turn_variance += member.weight * TurnVariance(snapshot, feature);
    }
  }
  if (total > 0) {
    estimate.covariance_in_world /= total;
    estimate.covariance_in_camera /= total;
    if (at_rest > 0) {  // it knows nothing of the camera's own error
      estimate.covariance_in_camera +=
          at_rest / total *
          RestCovarianceAt(snapshot, estimate.point_in_world, turn_variance / at_rest);
    }
  } else {
    estimate.covariance_in_camera = PoseCovarianceAt(snapshot, estimate.point_in_world);
  }
  const Eigen::Matrix3d turn = place.world_from_binding.RotationMatrix();
  const Eigen::Matrix3d own = turn * place.clicked_covariance * turn.transpose();
  const Eigen::Matrix3d camera_from_world = snapshot.world_from_camera.RotationMatrix().transpose();
  estimate.covariance_in_world += own;
  estimate.covariance_in_camera += camera_from_world * own * camera_from_world.transpose();
  return estimate;
}

/// Joins the cluster's word with the seeded feature's. The more certain covariance is reported: the
/// two share the camera's error, so that multiplying them would promise too much.
PlaceEstimate WithSeed(const MapView& map, const FeatureSnapshot& seed, PlaceEstimate estimate,
                       AnchorPlace& place) {
  if (!place.seed_is_target && seed.matched_count < kMinMatches) return estimate;
  const Eigen::Matrix3d world_from_camera = map.snapshot().world_from_camera.RotationMatrix();
  const Eigen::Matrix3d& prior = estimate.covariance_in_camera;
  const Eigen::Matrix3d sum_inverse =
      (prior + seed.covariance_in_camera + 1e-12 * Eigen::Matrix3d::Identity()).inverse();
  const Eigen::Vector3d difference =
      world_from_camera.transpose() * (seed.point_in_world - estimate.point_in_world);
  Eigen::Matrix3d gain = prior * sum_inverse;
  const bool mature = seed.depth_known && seed.matched_count >= kManyMatches;
  const bool consistent = difference.dot(sum_inverse * difference) < kConsistentChi2;
  if (place.seed_is_target || (!consistent && mature)) gain.setIdentity();
  if (!place.seed_is_target && !consistent && !mature) return estimate;
  if (!gain.allFinite()) return estimate;
  estimate.point_in_world += world_from_camera * gain * difference;
  // While nobody has seen whether the click is on an outline, its patch may be half one thing, half
  // another: it moves the mark, but vouches for nothing.
  const bool better = !AwaitsLook(map, place) && seed.covariance_in_camera.trace() < prior.trace();
  if (better || place.seed_is_target || !consistent) {
    estimate.covariance_in_camera = seed.covariance_in_camera;
    estimate.covariance_in_world = seed.covariance_in_world;
    const Eigen::Matrix3d turn =
        place.world_from_binding.RotationMatrix().transpose() * world_from_camera;
    place.seed_covariance = turn * seed.covariance_in_camera * turn.transpose();
  }
  return estimate;
}

/// The map dropped the seeded feature: what it taught stays, certainty too.
void ForgetSeed(AnchorPlace& place) {
  if (place.seed_seen) place.clicked_point = place.point;
  if (place.seed_covariance) place.clicked_covariance = *place.seed_covariance;
  place.seed.reset();
  place.seed_is_target = false;
}

}  // namespace

MapView::MapView(std::shared_ptr<const MapSnapshot> snapshot, const ScaleChain* scale,
                 const PoseTrail* trail, std::shared_ptr<const SurfaceSnapshot> surface)
    : snapshot_(std::move(snapshot)), scale_(scale), trail_(trail), surface_(std::move(surface)) {
  const std::vector<FeatureSnapshot>& features = snapshot_->features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (k == 0 || features[k].id <= features[k - 1].id) stretches_.push_back(k);
  }
}

const FeatureSnapshot* MapView::Find(FeatureId id) const {
  const std::vector<FeatureSnapshot>& features = snapshot_->features;
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    const std::size_t end = s + 1 < stretches_.size() ? stretches_[s + 1] : features.size();
    const auto last = features.begin() + static_cast<std::ptrdiff_t>(end);
    const auto at = std::lower_bound(
        features.begin() + static_cast<std::ptrdiff_t>(stretches_[s]), last, id,
        [](const FeatureSnapshot& feature, FeatureId key) { return feature.id < key; });
    if (at == last || at->id != id) continue;
    const double check =
        at->point_in_world.sum() + at->covariance_in_world.sum() + at->covariance_in_camera.sum();
    if (std::isfinite(check)) return &*at;
  }
  return nullptr;
}

PlaceEstimate Follow(const MapView& map, const AnchorOptions& options, AnchorPlace& place,
                     int& selections_left) {
  const Timestamp now_ns = map.snapshot().capture_time_ns;
  const double dt =
      place.last_time_ns == 0 ? 0 : std::max(0.0, Seconds(now_ns - place.last_time_ns));
  place.last_time_ns = now_ns;
  DropLostMembers(map, place);
  place.world_from_binding = FitMembers(map, place);
  Replenish(map, options, place, selections_left);
  for (ClusterMember& member : place.members) {
    member.last_in_world = map.Find(member.id)->point_in_world;
  }

  if (place.was_sure && IsSeen(map, place)) place.seen_s += std::min(dt, kLongestStep_s);
  if (place.placed_ns == 0) place.placed_ns = now_ns;
  PlaceEstimate estimate = FromCluster(map, place);
  if (place.seed) {
    if (const FeatureSnapshot* seed = map.Find(*place.seed)) {
      place.seed_seen = true;
      estimate = WithSeed(map, *seed, estimate, place);
      // What it could teach it has taught; from now on six or more features know better than one
      // where the place is.
      const bool taught = seed->depth_known && seed->matched_count >= kManyMatches;
      if (taught && !place.seed_is_target && place.seen_s > kSettled_s) ForgetSeed(place);
    } else if (place.seed_seen || std::abs(now_ns - place.placed_ns) > kSeedGraceNs) {
      ForgetSeed(place);
      estimate = FromCluster(map, place);
    }
  }
  const Eigen::Vector3d wanted = place.world_from_binding.Inverse() * estimate.point_in_world;
  place.point += (1.0 - std::exp(-dt / options.refine_time_s)) * (wanted - place.point);

  const Eigen::Vector3d best = estimate.point_in_world;
  estimate.point_in_world = place.world_from_binding * place.point;
  const Eigen::Vector3d lag = best - estimate.point_in_world;
  const Eigen::Vector3d lag_in_camera = map.snapshot().world_from_camera.rotation.conjugate() * lag;
  estimate.covariance_in_world += lag * lag.transpose();
  estimate.covariance_in_camera += lag_in_camera * lag_in_camera.transpose();
  NoteSure(map, options, estimate, place);
  AddScale(map, place, estimate);
  AddDoubt(map, place, estimate);
  return estimate;
}

}  // namespace saccade
