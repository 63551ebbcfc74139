#include "server/tracker/loop_closer.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <map>

#include "server/pipeline/stop_watch.hpp"

namespace saccade {
namespace {

constexpr int kQueryEvery = 15;         // frames
constexpr int kQueryTaken = 6;          // frames after its start; it lasts 10 to 80 ms
constexpr int kSolvingTaken = 8;        // the same of the pose graph
constexpr std::size_t kFewestOld = 20;  // landmarks, to be worth a query
constexpr double kMissed_px = 16.0;     // further off the ordinary search would miss them
constexpr double kMostDrift = 0.25;     // of the way since the old place was left
constexpr double kMostTurned_rad = 0.6;
constexpr int kLookEvery = 3, kSightsNeeded = 4, kMostFailed = 3;
constexpr double kMovedShare = 0.03, kTurned_rad = 0.05;  // between the first sight and the last
constexpr std::size_t kMostSights = 12;
constexpr int kPause = 60;              // frames after a candidate that proved false
constexpr std::int64_t kWayEvery = 30;  // frames

/// The shift between where the filter expects old landmarks and where they were seen, median [px].
double Displacement(const Relocalisation& found, const Rigid3& present, const CameraModel& camera) {
  std::vector<double> off;
  const Rigid3 camera_from_world = present.Inverse();
  for (const Correspondence& inlier : found.inliers) {
    const auto expected = camera.Project(camera_from_world * inlier.point_in_world);
    off.push_back(expected ? (*expected - inlier.pixel).norm() : 1e6);
  }
  const auto middle = off.begin() + std::ssize(off) / 2;
  std::nth_element(off.begin(), middle, off.end());
  return *middle;
}

KeyframeId MostFrequent(const std::vector<LoopSight>& sights) {
  std::map<KeyframeId, int> counts;
  for (const LoopSight& sight : sights) {
    for (const KeyframeId id : sight.anchors) ++counts[id];
  }
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

void StepBack(bool live) {
  // What is live comes first.
  if (live) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
}

}  // namespace

LoopCloser::LoopCloser(const TrackerOptions& options, const Relocaliser& relocaliser)
    : options_(options), relocaliser_(relocaliser) {}

LoopCloser::~LoopCloser() { Stop(); }

void LoopCloser::Stop() {
  stop_ = true;
  if (query_.valid()) query_.get();
  if (solving_.valid()) solving_.get();
  stop_ = false;
}

void LoopCloser::Reset() {
  Stop();
  candidate_.reset();
  last_pose_.reset();
  pause_until_ = 0;
}

void LoopCloser::Wait() const {
  if (query_.valid()) query_.wait();
  if (solving_.valid()) solving_.wait();
}

bool LoopCloser::Due(std::int64_t frame_number) const {
  const int after = query_.valid() ? kQueryTaken : kSolvingTaken;
  if (frame_number < started_ + after) return false;
  if (!options_.adjust_live) return true;
  const auto now = std::chrono::seconds(0);
  return query_.valid() ? query_.wait_for(now) == std::future_status::ready
                        : solving_.wait_for(now) == std::future_status::ready;
}

bool LoopCloser::WantsOld(std::int64_t frame_number) const {
  if (query_.valid() || solving_.valid()) return false;
  if (candidate_) return frame_number >= candidate_->next_look;
  return frame_number >= pause_until_ && frame_number % kQueryEvery == 0;
}

void LoopCloser::BookWay(const LoopView& view) {
  const Rigid3& pose = view.filter.camera().world_from_camera;
  if (std::ssize(way_after_) > view.frame_number / kWayEvery + 1) way_after_.clear();  // a new map
  if (last_pose_) way_m_ += (pose.translation - last_pose_->translation).norm();
  last_pose_ = pose;
  while (std::ssize(way_after_) <= view.frame_number / kWayEvery) way_after_.push_back(way_m_);
}

std::optional<MapCorrection> LoopCloser::Step(const LoopView& view) {
  waited_ms_ = 0.0;
  BookWay(view);
  if (query_.valid()) {
    if (Due(view.frame_number)) TakeQuery(view);
  } else if (solving_.valid()) {
    if (!Due(view.frame_number)) return std::nullopt;
    StopWatch watch;
    std::optional<MapCorrection> correction = solving_.get();
    waited_ms_ = watch.Lap_ms();
    last_pose_.reset();
    pause_until_ = view.frame_number + kPause;
    return correction;
  } else if (candidate_) {
    if (view.frame_number >= candidate_->next_look) Look(view);
  } else if (WantsOld(view.frame_number) && view.old.size() >= kFewestOld) {
    StartQuery(view);
  }
  return std::nullopt;
}

void LoopCloser::StartQuery(const LoopView& view) {
  std::unordered_map<FeatureId, Eigen::Vector3d> points;
  last_met_.clear();
  for (const auto& [dormant, known] : view.old) {
    last_met_[dormant->landmark.id] = dormant->landmark.last_matched_frame;
    points[dormant->landmark.id] = known.PointInWorld();
  }
  started_ = view.frame_number;
  query_pose_ = view.filter.camera().world_from_camera;
  query_ = std::async(std::launch::async, [this, points = std::move(points),
                                           grey = view.frame.grey.clone(),
                                           camera = view.frame.camera] {
    StepBack(options_.adjust_live);
    return relocaliser_.Query(grey, *camera, [&](FeatureId id) -> std::optional<Eigen::Vector3d> {
      const auto at = points.find(id);
      if (at == points.end()) return std::nullopt;
      return at->second;
    });
  });
}

bool LoopCloser::Plausible(const Relocalisation& found) const {
  std::vector<std::int64_t> left;  // frame in which each was last met
  for (const Correspondence& inlier : found.inliers) {
    const auto met = last_met_.find(inlier.id);
    if (met != last_met_.end()) left.push_back(met->second);
  }
  if (left.empty()) return false;
  const auto middle = left.begin() + std::ssize(left) / 2;
  std::nth_element(left.begin(), middle, left.end());
  const double way =
      way_m_ -
      way_after_[std::clamp<std::int64_t>(*middle / kWayEvery, 0, std::ssize(way_after_) - 1)];
  return (found.world_from_camera.translation - query_pose_.translation).norm() <
             kMostDrift * way &&
         RotationAngle(found.world_from_camera, query_pose_) < kMostTurned_rad;
}

void LoopCloser::TakeQuery(const LoopView& view) {
  StopWatch watch;
  const std::optional<Relocalisation> found = query_.get();
  waited_ms_ = watch.Lap_ms();
  if (!found || Displacement(*found, query_pose_, *view.frame.camera) < kMissed_px ||
      !Plausible(*found)) {
    return;
  }
  candidate_.emplace();
  candidate_->old_from_present =
      Similarity3::FromRigid(found->world_from_camera * query_pose_.Inverse());
  candidate_->next_look = view.frame_number + 1;
}

void LoopCloser::Look(const LoopView& view) {
  Candidate& candidate = *candidate_;
  candidate.next_look = view.frame_number + kLookEvery;
  const Rigid3& present = view.filter.camera().world_from_camera;
  const auto sight = LookForOld(view.old, candidate.old_from_present.Move(present), view.pyramid,
                                *view.frame.camera, view.filter, view.matches);
  if (!sight) {
    if (++candidate.failed < kMostFailed) return;
    candidate_.reset();
    pause_until_ = view.frame_number + kPause;
    return;
  }
  candidate.sights.push_back(*sight);
  candidate.old_from_present = Similarity3::FromRigid(sight->old_from_camera * present.Inverse());
  const LoopSight& first = candidate.sights.front();
  const bool moved =
      (sight->present_from_camera.translation - first.present_from_camera.translation).norm() >
          kMovedShare * sight->distance_m ||
      RotationAngle(sight->present_from_camera, first.present_from_camera) > kTurned_rad;
  if (moved && std::ssize(candidate.sights) >= kSightsNeeded) {
    if (const auto agreement = Agree(candidate.sights)) StartSolving(view, *agreement);
  }
  if (candidate_ && candidate.sights.size() >= kMostSights) candidate_.reset();
}

void LoopCloser::StartSolving(const LoopView& view, const LoopAgreement& agreement) {
  KeyframeGraph::Outline outline = view.graph.MakeOutline();
  Loop loop;
  loop.old_keyframe = MostFrequent(candidate_->sights);
  loop.new_keyframe = outline.keyframes.back().id;
  loop.old_from_new = agreement.old_from_present;
  loop.distance_m = candidate_->sights.back().distance_m;
  loop.log_scale_sigma = agreement.log_scale_sigma;
  loop.rigid_from = view.rigid_from;
  candidate_.reset();
  started_ = view.frame_number;
  solving_ = std::async(std::launch::async, [this, loop, outline = std::move(outline)] {
    StepBack(options_.adjust_live);
    return CloseLoop(outline, loop, &stop_);
  });
}

}  // namespace saccade
