#include "server/map/map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace saccade {
namespace {

constexpr double kKeyframeShare = 0.01;  // of the distance to what is in view
constexpr double kKeyframeAngle_rad = 0.03;
constexpr double kLeastDepthSigma = 0.005;  // a woken one's; of its inverse range

std::optional<GraphEstimate> EstimateOf(const FilterState& filter, FeatureId id) {
  if (!filter.Has(id)) return std::nullopt;
  const PointFromClone point = filter.Point(id);
  return GraphEstimate{point.bearing, point.inverse_range};
}

}  // namespace

void Map::Clear() {
  in_use_.Clear();
  at_rest_.Clear();
  keyframes_.Clear();
  clones_.clear();
  newest_feature_ = 0;
}

void Map::BeginAnew(const FilterState& filter) {
  at_rest_.Clear();
  std::vector<FeatureId> gone;
  for (const Landmark& landmark : in_use_.all()) {
    if (StateOf(landmark.id, filter) == LandmarkState::kGone) gone.push_back(landmark.id);
  }
  in_use_.Remove(gone);
  keyframes_.Clear();
  clones_.clear();
  newest_feature_ = 0;
}

LandmarkState Map::StateOf(FeatureId id, const FilterState& filter) const {
  const Landmark* landmark = in_use_.Find(id);
  if (landmark != nullptr && landmark->known) return LandmarkState::kKnown;
  if (landmark != nullptr && filter.Has(id)) return LandmarkState::kInFilter;
  return at_rest_.Has(id) ? LandmarkState::kAtRest : LandmarkState::kGone;
}

std::optional<Eigen::Vector3d> Map::Where(FeatureId id, const FilterState& filter) const {
  switch (StateOf(id, filter)) {
    case LandmarkState::kKnown:
      return in_use_.Find(id)->known->point_in_world;
    case LandmarkState::kInFilter:
      return filter.Marginal(id).point_in_world;
    case LandmarkState::kAtRest: {
      const auto recalled = Recall(id);
      if (!recalled || !(recalled->estimate.inverse_range > 0.0)) return std::nullopt;
      return recalled->PointInWorld();
    }
    case LandmarkState::kGone:
      break;
  }
  return std::nullopt;
}

bool Map::HasNews(const FilterState& filter, double distance_m) const {
  const std::vector<FeatureId> ids = filter.FeatureIds();
  if (!ids.empty() && ids.back() > newest_feature_) return true;
  const Rigid3& pose = filter.camera().world_from_camera;
  const auto newest = keyframes_.Newest();
  return !newest || (newest->translation - pose.translation).norm() > kKeyframeShare * distance_m ||
         RotationAngle(*newest, pose) > kKeyframeAngle_rad;
}

void Map::AddKeyframe(const FilterState& filter, double distance_m, double bearing_sigma_rad,
                      std::span<const GraphSighting> sightings) {
  std::vector<GraphBirth> births;
  std::optional<CloneId> clone;
  const std::vector<FeatureId> ids = filter.FeatureIds();
  for (auto id = ids.rbegin(); id != ids.rend() && *id > newest_feature_; ++id) {
    const PointFromClone point = filter.Point(*id);
    births.push_back({*id, point.bearing, bearing_sigma_rad, point.inverse_range,
                      filter.Marginal(*id).inverse_range_sigma});
    clone = filter.CloneOf(*id);
  }
  using Life = KeyframeGraph::Life;
  const KeyframeId id = keyframes_.Add(filter.camera().world_from_camera, distance_m, sightings,
                                       births, [&](FeatureId each) {
                                         if (filter.Has(each)) return Life::kInFilter;
                                         return at_rest_.Has(each) ? Life::kAtRest : Life::kGone;
                                       });
  if (clone) clones_[id] = *clone;
  if (!ids.empty()) newest_feature_ = std::max(newest_feature_, ids.back());
}

void Map::TakeKeyframe(const Rigid3& world_from_camera, double distance_m,
                       std::span<const GraphSighting> sightings, std::span<const GraphBirth> births,
                       std::optional<CloneId> clone) {
  const KeyframeId id = keyframes_.Add(world_from_camera, distance_m, sightings, births);
  if (clone) clones_[id] = *clone;
  for (const GraphBirth& birth : births) newest_feature_ = std::max(newest_feature_, birth.id);
}

void Map::Retire(std::span<const FeatureId> ids, const Judge& judge, FilterState& filter) {
  for (const FeatureId id : ids) {
    const Landmark* landmark = in_use_.Find(id);
    const std::optional<RestNote> note = landmark != nullptr ? judge(*landmark) : std::nullopt;
    if (!note || !filter.Has(id)) continue;
    const FeatureMarginal marginal = filter.Marginal(id);
    DormantLandmark dormant;
    dormant.landmark = *landmark;
    if (note->forgiven) dormant.landmark.woken.reset();
    dormant.failures = note->failures;
    dormant.inverse_range_sigma = marginal.inverse_range_sigma;
    dormant.covariance_in_world = marginal.covariance_in_world;
    dormant.home = note->home;
    dormant.rests_until = note->rests_until;
    if (note->learnt) keyframes_.SetEstimate(id, *EstimateOf(filter, id));
    at_rest_.Put(std::move(dormant));
  }
  filter.Remove(ids);
  in_use_.Remove(ids);
}

void Map::Wake(KeyframeId keyframe, std::span<const FeatureId> ids, const Matrix6d& covariance,
               std::int64_t frame, FilterState& filter) {
  const CloneId clone = CloneOf(keyframe, covariance, filter);
  for (const FeatureId id : ids) WakeOne(id, clone, frame, filter);
  filter.Remove({});  // a clone that nothing was woken in goes again
}

void Map::WakeOne(FeatureId id, CloneId clone, std::int64_t frame, FilterState& filter) {
  const Recalled recalled = *Recall(id);
  DormantLandmark dormant = at_rest_.Take(id);
  FeatureBirth birth;
  birth.id = id;
  birth.bearing = recalled.estimate.bearing;
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(birth.bearing);
  birth.bearing_covariance =
      recalled.bearing_sigma_rad * recalled.bearing_sigma_rad * basis * basis.transpose();
  birth.inverse_range = recalled.estimate.inverse_range;
  birth.inverse_range_sigma =
      std::max(dormant.inverse_range_sigma, kLeastDepthSigma * birth.inverse_range);
  if (!filter.AddFeature(clone, birth).ok()) return;
  Landmark& landmark = dormant.landmark;
  landmark.woken = Landmark::Probation{.failures = dormant.failures};
  landmark.failed_in_row = 0;
  landmark.last_matched_frame = landmark.last_in_view_frame = frame;
  in_use_.Add(std::move(landmark));
}

CloneId Map::CloneOf(KeyframeId id, const Matrix6d& covariance, FilterState& filter) {
  const auto known = clones_.find(id);
  if (known != clones_.end() && filter.ClonePose(known->second)) return known->second;
  return clones_[id] = filter.AddClone(*keyframes_.Pose(id), covariance);
}

void Map::LocateAtRest() {
  at_rest_.Locate([this](KeyframeId id) { return keyframes_.Version(id); },
                  [this](FeatureId id) { return Recall(id); });
}

std::optional<KeyframeGraph::Job> Map::MakeJob(const FilterState& filter) const {
  return keyframes_.MakeJob([&](FeatureId id) { return EstimateOf(filter, id); });
}

void Map::Take(const KeyframeGraph::Job& job, FilterState& filter) {
  keyframes_.Take(job);
  // From the job: the keyframes may have dropped some of it since.
  Refinement refinement;
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    const Rigid3& pose = job.problem.keyframes[k].world_from_camera;
    const auto clone = clones_.find(job.keyframes[k]);
    if (clone != clones_.end()) refinement.clones[clone->second] = pose;
    if (job.keyframes[k] == job.newest) refinement.world_from_camera = pose;
  }
  for (std::size_t k = 0; k < job.points.size(); ++k) {
    const BundlePoint& point = job.problem.points[k];
    refinement.features[job.points[k]] = {point.bearing, point.inverse_range};
  }
  filter.Refine(refinement);
  ForgetClones(filter);
  for (auto it = clones_.upper_bound(job.newest); it != clones_.end(); ++it) {
    keyframes_.SetPose(it->first, *filter.ClonePose(it->second));
  }
}

void Map::RestTorn(const MapCorrection& correction, double torn_m, FilterState& filter) {
  std::vector<FeatureId> torn;
  for (const Landmark& landmark : in_use_.all()) {
    const auto recalled = Recall(landmark.id);
    if (!landmark.woken || !recalled || !(recalled->estimate.inverse_range > 0.0)) continue;
    const Eigen::Vector3d point = recalled->PointInWorld();
    const Eigen::Vector3d in_old = correction.Of(recalled->anchor) * point;
    if ((in_old - correction.newest() * point).norm() >= torn_m) torn.push_back(landmark.id);
  }
  // They belong to where they were, not to where the filter goes, and know nothing new.
  const RestNote note{.learnt = false, .forgiven = true};
  Retire(
      torn, [&](const Landmark&) { return note; }, filter);
}

void Map::Move(const MapCorrection& correction, double torn_m, FilterState& filter) {
  RestTorn(correction, torn_m, filter);
  at_rest_.Move([&](FeatureId id) -> Similarity3 {
    const auto recalled = Recall(id);
    return recalled ? correction.Of(recalled->anchor) : Similarity3();
  });
  ForgetClones(filter);
  keyframes_.Move([&](KeyframeId id) -> const Similarity3& { return correction.Of(id); });
  filter.MoveWorld(correction.newest());
}

void Map::Restore(const Checkpoint& checkpoint, FilterState& filter) {
  filter = checkpoint.filter;
  in_use_ = checkpoint.in_use;
  at_rest_ = checkpoint.at_rest;
  ForgetClones(filter);
}

void Map::ForgetClones(const FilterState& filter) {
  std::erase_if(clones_, [&](const auto& entry) { return !filter.ClonePose(entry.second); });
}

}  // namespace saccade
