#include "server/map/keyframe_graph.hpp"

#include <algorithm>
#include <set>

namespace saccade {
namespace {

constexpr std::size_t kNewest = 8;   // keyframes that are adjusted in any case
constexpr double kInformed = 0.1;    // sigma / inverse range of a birth that is more than a guess
constexpr double kLooseSigma = 1.0;  // of the present inverse range: keeps it from running away

bool Near(const Rigid3& a, const Rigid3& b, double distance_m, double angle_rad) {
  return (a.translation - b.translation).norm() < distance_m && RotationAngle(a, b) < angle_rad;
}

template <typename T>
int IndexOf(const std::vector<T>& rising, const T& value) {
  const auto at = std::lower_bound(rising.begin(), rising.end(), value);
  return at != rising.end() && *at == value ? static_cast<int>(at - rising.begin()) : -1;
}

}  // namespace

void KeyframeGraph::Clear() {
  keyframes_.clear();
  points_.clear();
}

KeyframeId KeyframeGraph::Add(const Rigid3& world_from_camera, double distance_m,
                              std::span<const GraphSighting> sightings,
                              std::span<const GraphBirth> births, const LifeOf& life) {
  const KeyframeId id = next_++;
  Keyframe& keyframe = keyframes_[id];
  keyframe.world_from_camera = world_from_camera;
  keyframe.distance_m = distance_m;
  keyframe.version = ++changes_;
  keyframe.sightings.assign(sightings.begin(), sightings.end());
  for (const GraphSighting& sighting : sightings) {
    const auto point = points_.find(sighting.id);
    if (point != points_.end()) point->second.seen_from.push_back(id);
  }
  for (const GraphBirth& birth : births) {
    points_[birth.id] = {id, birth, {birth.bearing, birth.inverse_range}, {}};
    keyframe.births.push_back(birth.id);
  }
  Thin(life);
  return id;
}

KeyframeId KeyframeGraph::LeastWorth(const LifeOf& life) const {
  KeyframeId least = keyframes_.begin()->first;
  int least_worth = static_cast<int>(Life::kInFilter) + 1;
  const auto newest = std::prev(keyframes_.end());
  for (auto at = keyframes_.begin(); at != newest && least_worth > 0; ++at) {
    int worth = 0;
    if (life) {
      for (const FeatureId id : at->second.births) {
        worth = std::max(worth, static_cast<int>(life(id)));
      }
    }
    if (worth >= least_worth) continue;
    least_worth = worth;
    least = at->first;
  }
  return least;
}

void KeyframeGraph::Thin(const LifeOf& life) {
  while (static_cast<int>(keyframes_.size()) > options_.max_keyframes) Erase(LeastWorth(life));
  if (static_cast<int>(keyframes_.size()) <= options_.dense_keyframes + 1) return;
  const auto old = std::prev(keyframes_.end(), options_.dense_keyframes + 1);
  if (old == keyframes_.begin() || !old->second.births.empty()) return;
  const Keyframe& before = std::prev(old)->second;
  if (Near(old->second.world_from_camera, before.world_from_camera,
           options_.apart_share * old->second.distance_m, options_.apart_rad)) {
    Erase(old->first);
  }
}

void KeyframeGraph::Erase(KeyframeId id) {
  const Keyframe& keyframe = keyframes_.at(id);
  for (const GraphSighting& sighting : keyframe.sightings) {
    const auto point = points_.find(sighting.id);
    if (point != points_.end()) std::erase(point->second.seen_from, id);
  }
  for (const FeatureId born : keyframe.births) points_.erase(born);
  keyframes_.erase(id);
}

bool KeyframeGraph::Load(Contents contents) {
  for (const auto& [id, keyframe] : contents.keyframes) {
    if (id < 0) return false;
    for (const FeatureId born : keyframe.births) {
      const auto point = contents.points.find(born);
      if (point == contents.points.end() || point->second.anchor != id) return false;
    }
  }
  for (const auto& [id, point] : contents.points) {
    if (!contents.keyframes.contains(point.anchor) || point.birth.id != id) return false;
    if (!std::is_sorted(point.seen_from.begin(), point.seen_from.end())) return false;
    for (const KeyframeId from : point.seen_from) {
      if (!contents.keyframes.contains(from)) return false;
    }
  }
  Clear();
  keyframes_ = std::move(contents.keyframes);
  points_ = std::move(contents.points);
  for (auto& [id, keyframe] : keyframes_) {
    keyframe.version = ++changes_;
    next_ = id + 1;
  }
  return true;
}

std::optional<Rigid3> KeyframeGraph::Newest() const {
  if (keyframes_.empty()) return std::nullopt;
  return keyframes_.rbegin()->second.world_from_camera;
}

std::optional<Rigid3> KeyframeGraph::Pose(KeyframeId id) const {
  const auto at = keyframes_.find(id);
  if (at == keyframes_.end()) return std::nullopt;
  return at->second.world_from_camera;
}

void KeyframeGraph::SetPose(KeyframeId id, const Rigid3& world_from_camera) {
  const auto at = keyframes_.find(id);
  if (at == keyframes_.end()) return;
  at->second.world_from_camera = world_from_camera;
  at->second.version = ++changes_;
}

std::uint64_t KeyframeGraph::Version(KeyframeId id) const {
  const auto at = keyframes_.find(id);
  return at == keyframes_.end() ? 0 : at->second.version;
}

std::optional<KeyframeGraph::Recalled> KeyframeGraph::Recall(FeatureId id) const {
  const auto at = points_.find(id);
  if (at == points_.end()) return std::nullopt;
  const Point& point = at->second;
  return Recalled{point.anchor, keyframes_.at(point.anchor).world_from_camera, point.estimate,
                  point.birth.sigma_rad};
}

void KeyframeGraph::SetEstimate(FeatureId id, const GraphEstimate& estimate) {
  const auto at = points_.find(id);
  if (at == points_.end()) return;
  at->second.estimate = estimate;
  keyframes_.at(at->second.anchor).version = ++changes_;
}

KeyframeGraph::Ranked KeyframeGraph::WhoSees(std::span<const FeatureId> points) const {
  const KeyframeId first = keyframes_.begin()->first;
  std::vector<int> counts(static_cast<std::size_t>(next_ - first), 0);
  for (const FeatureId id : points) {
    const Point& point = points_.at(id);
    ++counts[static_cast<std::size_t>(point.anchor - first)];
    for (const KeyframeId from : point.seen_from) ++counts[static_cast<std::size_t>(from - first)];
  }
  Ranked ranked;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] > 0) ranked.emplace_back(counts[k], first + static_cast<KeyframeId>(k));
  }
  std::sort(ranked.rbegin(), ranked.rend());
  return ranked;
}

std::vector<KeyframeId> KeyframeGraph::Adjusted() const {
  std::set<KeyframeId> chosen;
  std::set<FeatureId> in_view;
  for (auto it = keyframes_.rbegin(); it != keyframes_.rend() && chosen.size() < kNewest; ++it) {
    chosen.insert(it->first);
    for (const GraphSighting& sighting : it->second.sightings) {
      if (points_.contains(sighting.id)) in_view.insert(sighting.id);
    }
  }
  for (const auto& [count, id] : WhoSees(std::vector<FeatureId>(in_view.begin(), in_view.end()))) {
    if (static_cast<int>(chosen.size()) >= options_.adjusted_keyframes) break;
    chosen.insert(id);
  }
  return {chosen.begin(), chosen.end()};
}

std::vector<FeatureId> KeyframeGraph::PointsOf(const std::vector<KeyframeId>& adjusted) const {
  std::map<FeatureId, int> sightings_of;
  for (const KeyframeId id : adjusted) {
    for (const GraphSighting& sighting : keyframes_.at(id).sightings) ++sightings_of[sighting.id];
  }
  std::vector<std::pair<int, FeatureId>> ranked;
  for (const auto& [id, count] : sightings_of) {
    const auto point = points_.find(id);
    if (point != points_.end() && point->second.seen_from.size() >= 2) {
      ranked.emplace_back(count, id);
    }
  }
  std::sort(ranked.rbegin(), ranked.rend());
  if (static_cast<int>(ranked.size()) > options_.max_points) ranked.resize(options_.max_points);
  std::vector<FeatureId> points;
  for (const auto& [count, id] : ranked) points.push_back(id);
  return points;
}

void KeyframeGraph::ChooseKeyframes(const std::vector<KeyframeId>& adjusted, Job& job) const {
  const std::set<KeyframeId> free(adjusted.begin(), adjusted.end());
  std::set<KeyframeId> all = free;
  int held = 0;
  for (const FeatureId id : job.points) held += all.insert(points_.at(id).anchor).second ? 1 : 0;
  for (const auto& [count, id] : WhoSees(job.points)) {
    if (held >= options_.held_keyframes) break;
    held += all.insert(id).second ? 1 : 0;
  }
  for (const KeyframeId id : all) {
    job.keyframes.push_back(id);
    job.problem.keyframes.push_back({keyframes_.at(id).world_from_camera, !free.contains(id)});
  }
}

void KeyframeGraph::ChoosePoints(const Lookup& estimate, Job& job) const {
  for (const FeatureId id : job.points) {
    const Point& point = points_.at(id);
    const GraphEstimate now = estimate(id).value_or(point.estimate);
    const GraphBirth& birth = point.birth;
    BundlePoint bundled;
    bundled.anchor = IndexOf(job.keyframes, point.anchor);
    bundled.bearing = now.bearing;
    bundled.inverse_range = now.inverse_range;
    bundled.seen = birth.bearing;
    bundled.seen_sigma_rad = birth.sigma_rad;
    const bool informed = birth.inverse_range_sigma < kInformed * birth.inverse_range;
    bundled.prior_inverse_range = informed ? birth.inverse_range : now.inverse_range;
    bundled.prior_sigma = informed ? birth.inverse_range_sigma
                                   : kLooseSigma * std::max(1e-3, std::abs(now.inverse_range));
    job.problem.points.push_back(bundled);
  }
}

void KeyframeGraph::AddSightings(Job& job) const {
  std::unordered_map<FeatureId, int> index;
  for (std::size_t k = 0; k < job.points.size(); ++k) index[job.points[k]] = static_cast<int>(k);
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    const int at = static_cast<int>(k);
    const bool fixed = job.problem.keyframes[k].fixed;
    for (const GraphSighting& sighting : keyframes_.at(job.keyframes[k]).sightings) {
      if (sighting.known_point && !fixed) {
        job.problem.known.push_back({at, *sighting.known_point, sighting.ray, sighting.sigma_rad});
      }
      const auto point = index.find(sighting.id);
      if (point == index.end()) continue;
      job.problem.sightings.push_back({at, point->second, sighting.ray, sighting.sigma_rad});
    }
  }
}

bool KeyframeGraph::ShowsParallax(Job& job) const {
  BundleProblem& problem = job.problem;
  for (const BundleSighting& sighting : problem.sightings) {
    BundlePoint& point = problem.points[sighting.point];
    const Rigid3& anchor = problem.keyframes[point.anchor].world_from_camera;
    const Eigen::Vector3d ray = anchor.rotation * point.bearing;
    const Eigen::Vector3d baseline =
        problem.keyframes[sighting.keyframe].world_from_camera.translation - anchor.translation;
    const double across = (baseline - baseline.dot(ray) * ray).norm();
    point.parallax_sigmas = std::max(point.parallax_sigmas,
                                     std::abs(point.inverse_range) * across / sighting.sigma_rad);
  }
  std::vector<int> telling(problem.keyframes.size(), 0);
  for (const BundleSighting& sighting : problem.sightings) {
    const double parallax = problem.points[sighting.point].parallax_sigmas;
    telling[sighting.keyframe] += parallax > options_.parallax_sigmas ? 1 : 0;
  }
  for (const BundlePoint& point : problem.points) {
    telling[point.anchor] += point.parallax_sigmas > options_.parallax_sigmas ? 1 : 0;
  }
  for (const BundleKnownSighting& sighting : problem.known) ++telling[sighting.keyframe];
  for (std::size_t k = 0; k < telling.size(); ++k) {
    problem.keyframes[k].fixed |= telling[k] < options_.least_points;
  }
  return telling[IndexOf(job.keyframes, job.newest)] >= options_.parallax_points;
}

std::optional<KeyframeGraph::Job> KeyframeGraph::MakeJob(const Lookup& estimate) const {
  if (keyframes_.size() < 3) return std::nullopt;
  Job job;
  job.newest = keyframes_.rbegin()->first;
  const std::vector<KeyframeId> adjusted = Adjusted();
  job.points = PointsOf(adjusted);
  ChooseKeyframes(adjusted, job);
  ChoosePoints(estimate, job);
  AddSightings(job);
  if (!ShowsParallax(job)) return std::nullopt;
  FindRecent(job);
  return job;
}

void KeyframeGraph::Take(const Job& job) {
  const int newest = IndexOf(job.keyframes, job.newest);
  const auto before = Pose(job.newest);
  if (newest < 0 || !before) return;
  const Rigid3 moved = job.problem.keyframes[newest].world_from_camera * before->Inverse();
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    SetPose(job.keyframes[k], job.problem.keyframes[k].world_from_camera);
  }
  for (auto it = keyframes_.upper_bound(job.newest); it != keyframes_.end(); ++it) {
    it->second.world_from_camera = moved * it->second.world_from_camera;
    it->second.version = ++changes_;
  }
  for (std::size_t k = 0; k < job.points.size(); ++k) {
    const auto at = points_.find(job.points[k]);
    if (at == points_.end()) continue;
    at->second.estimate = {job.problem.points[k].bearing, job.problem.points[k].inverse_range};
    keyframes_.at(at->second.anchor).version = ++changes_;
  }
}

}  // namespace saccade
