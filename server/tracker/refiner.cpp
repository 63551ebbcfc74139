#include "server/tracker/refiner.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>

#include "server/pipeline/stop_watch.hpp"

namespace saccade {
namespace {

constexpr double kLongestDelay_s = 0.055;  // for an adjustment, where frames take longer
constexpr double kKeyframeShare = 0.01;    // of the distance to what is in view
constexpr double kKeyframeAngle_rad = 0.03;
// An adjustment that moves the camera by more is told to the experts as a jump.
constexpr double kJumpShare = 0.02;
constexpr double kJumpAngle_rad = 0.02;

std::optional<GraphEstimate> EstimateOf(const FilterState& filter, FeatureId id) {
  if (!filter.Has(id)) return std::nullopt;
  const AnchoredPoint point = filter.Point(id);
  return GraphEstimate{point.bearing, point.inverse_range};
}

}  // namespace

Refiner::Refiner(const TrackerOptions& options)
    : options_(options), graph_(KeyframeGraphOptions()) {}

Refiner::~Refiner() { Stop(); }

void Refiner::Stop() {
  if (!running_.valid()) return;
  stop_ = true;
  running_.get();
  stop_ = false;
}

void Refiner::Drop(FilterState& filter) {
  Stop();
  filter.DropMark();
}

void Refiner::Reset() {
  Stop();
  graph_.Clear();
  clones_.clear();
  fresh_ = false;
  newest_feature_ = 0;
}

void Refiner::Keep(const CameraModel& camera, const FilterState& filter,
                   const FrameMatches& matches, double inverse_range,
                   const KeyframeGraph::LifeOf& life) {
  if (!options_.adjust) return;
  const double focal = 0.5 * (camera.intrinsics().fx + camera.intrinsics().fy);
  std::vector<GraphBirth> births;
  std::optional<AnchorPoseId> clone;
  const std::vector<FeatureId> ids = filter.FeatureIds();
  for (auto id = ids.rbegin(); id != ids.rend() && *id > newest_feature_; ++id) {
    const AnchoredPoint point = filter.Point(*id);
    births.push_back({*id, point.bearing, options_.pixel_sigma_px / focal, point.inverse_range,
                      filter.Marginal(*id).inverse_range_sigma});
    clone = filter.AnchorOf(*id);
  }
  const Rigid3& pose = filter.camera().world_from_camera;
  const double distance = 1.0 / std::max(1e-6, inverse_range);
  const auto newest = graph_.Newest();
  fresh_ = !births.empty() || !newest ||
           (newest->translation - pose.translation).norm() > kKeyframeShare * distance ||
           RotationAngle(*newest, pose) > kKeyframeAngle_rad;
  if (!fresh_) return;
  std::vector<GraphSighting> sightings;
  for (const LandmarkMatch& match : matches.in_view) {
    if (!match.accepted()) continue;
    const auto ray = camera.Unproject(match.pixel - match.row_shift);
    if (!ray) continue;
    GraphSighting sighting{match.id, ray->normalized(), std::sqrt(match.noise(0, 0)) / focal, {}};
    if (const auto* known = std::get_if<Eigen::Vector3d>(&match.point)) {
      sighting.known_point = *known;
    }
    sightings.push_back(sighting);
  }
  const KeyframeId id = graph_.Add(pose, distance, sightings, births, life);
  if (clone) clones_[id] = *clone;
  if (!ids.empty()) newest_feature_ = std::max(newest_feature_, ids.back());
}

void Refiner::Take(const Rigid3& world_from_camera, double distance,
                   std::span<const GraphSighting> seen, std::span<const GraphBirth> births,
                   std::optional<AnchorPoseId> clone) {
  if (!options_.adjust) return;
  const KeyframeId id = graph_.Add(world_from_camera, distance, seen, births);
  if (clone) clones_[id] = *clone;
  for (const GraphBirth& birth : births) newest_feature_ = std::max(newest_feature_, birth.id);
}

void Refiner::Start(std::int64_t frame, Timestamp time_ns, FilterState& filter) {
  if (!options_.adjust || !fresh_ || running_.valid()) return;
  auto job = graph_.MakeJob([&](FeatureId id) { return EstimateOf(filter, id); });
  if (!job) return;
  started_ = frame;
  started_ns_ = time_ns;
  filter.Mark();
  running_ = std::async(std::launch::async, [this, job = *std::move(job)]() mutable {
    // Late is no loss, but pictures and heartbeats are: what is live comes first.
    if (options_.adjust_live) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    std::optional<KeyframeGraph::Job> done;
    if (AdjustBundle(job.problem, stop_)) done = std::move(job);
    return done;
  });
}

void Refiner::Rest(FeatureId id, const FilterState& filter) {
  if (const auto estimate = EstimateOf(filter, id)) graph_.SetEstimate(id, *estimate);
}

AnchorPoseId Refiner::CloneOf(KeyframeId id, const Matrix6d& covariance, FilterState& filter) {
  const auto known = clones_.find(id);
  if (known != clones_.end() && filter.AnchorPose(known->second)) return known->second;
  return clones_[id] = filter.AddAnchor(*graph_.Pose(id), covariance);
}

void Refiner::ForgetClones(const FilterState& filter) {
  std::erase_if(clones_, [&](const auto& entry) { return !filter.AnchorPose(entry.second); });
}

void Refiner::Move(const MapCorrection& correction, FilterState& filter) {
  Drop(filter);
  ForgetClones(filter);
  graph_.Move([&](KeyframeId id) -> const Similarity3& { return correction.Of(id); });
  filter.MoveWorld(correction.newest());
}

void Refiner::Wait() const {
  if (running_.valid()) running_.wait();
}

bool Refiner::Finish(std::int64_t frame, Timestamp time_ns, double inverse_range,
                     FilterState& filter) {
  waited_ms_ = 0.0;
  const bool due = frame >= started_ + options_.adjust_delay ||
                   Seconds(time_ns - started_ns_) >= kLongestDelay_s;
  if (!running_.valid() || !due) return false;
  if (options_.adjust_live &&
      running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return false;
  }
  StopWatch watch;
  const auto job = running_.get();
  waited_ms_ = watch.Lap_ms();
  if (!job) {
    filter.DropMark();
    return false;
  }
  const Rigid3 before = filter.camera().world_from_camera;
  Put(*job, filter);
  const Rigid3& after = filter.camera().world_from_camera;
  return (after.translation - before.translation).norm() * inverse_range > kJumpShare ||
         RotationAngle(before, after) > kJumpAngle_rad;
}

void Refiner::Put(const KeyframeGraph::Job& job, FilterState& filter) {
  graph_.Take(job);
  // From the job: the graph may have dropped some of it since.
  Refinement refinement;
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    const Rigid3& pose = job.problem.keyframes[k].world_from_camera;
    const auto clone = clones_.find(job.keyframes[k]);
    if (clone != clones_.end()) refinement.anchors[clone->second] = pose;
    if (job.keyframes[k] == job.newest) refinement.world_from_camera = pose;
  }
  for (std::size_t k = 0; k < job.points.size(); ++k) {
    const BundlePoint& point = job.problem.points[k];
    refinement.features[job.points[k]] = {point.bearing, point.inverse_range};
  }
  filter.Refine(refinement);
  ForgetClones(filter);
  for (auto it = clones_.upper_bound(job.newest); it != clones_.end(); ++it) {
    graph_.SetPose(it->first, *filter.AnchorPose(it->second));
  }
}

}  // namespace saccade
