#include "server/gaze/gaze_loop.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

namespace saccade {
namespace {

constexpr double kSureOfRotation_rad = 0.02;  // 1 sigma, worst axis

constexpr int kFollowed = 12;  // matches by which a turn is followed

/// Before distances are known a camera's direction is: it can be turned, and has to be, perhaps.
bool FollowsTurns(const MapSnapshot& map) {
  return map.status == TrackingStatus::kInitialising && map.matched >= kFollowed;
}

/// Not while coasting: that is the tracker's guess, and the wearer's own prediction knows the head.
bool HasPose(const MapSnapshot& map) {
  return (map.status == TrackingStatus::kTracking || FollowsTurns(map)) &&
         map.pose_covariance.diagonal().tail<3>().maxCoeff() <
             kSureOfRotation_rad * kSureOfRotation_rad;
}

}  // namespace

GazeLoop::GazeLoop(Mount& mount, const GazeOptions& options, std::function<std::string()> new_id)
    : mount_(mount),
      options_(options),
      controller_(mount.model(), options),
      arbiter_(options, std::move(new_id)),
      calibration_(mount),
      exploring_(options.explore_when_idle) {
  Publish(0);
}

std::optional<Eigen::Vector3d> GazeLoop::PointOf(const GazeTarget& target) const {
  if (const auto* point = std::get_if<GazePoint>(&target)) return point->in_world;
  if (const auto* feature = std::get_if<GazeFeature>(&target)) {
    if (!view_.map) return std::nullopt;
    for (const FeatureSnapshot& one : view_.map->features) {
      if (one.id == feature->id) return one.point_in_world;
    }
    return std::nullopt;
  }
  if (!view_.annotations) return std::nullopt;
  for (const Annotation& one : *view_.annotations) {
    if (one.id != std::get<GazeAnnotation>(target).id) continue;
    if (!one.anchor.place_known || one.anchor.state == AnchorState::kStopped) return std::nullopt;
    return one.anchor.point_in_world;
  }
  return std::nullopt;
}

absl::StatusOr<Eigen::Vector3d> GazeLoop::Resolve(const GazeTarget& target) const {
  if (const std::optional<Eigen::Vector3d> point = PointOf(target)) return *point;
  if (const auto* feature = std::get_if<GazeFeature>(&target)) {
    return absl::NotFoundError(
        absl::StrCat("target.feature_id: ", feature->id, " is not in the map"));
  }
  return absl::NotFoundError(
      absl::StrCat("target.annotation_id: ", std::get<GazeAnnotation>(target).id,
                   " does not exist, or its place in this map is not known"));
}

absl::Status GazeLoop::Fixate(const GazeTarget& target, bool fast) {
  const absl::StatusOr<Eigen::Vector3d> point = Resolve(target);
  if (!point.ok()) return point.status();
  if (absl::Status taken = controller_.Fixate(*point, fast); !taken.ok()) return taken;
  StopCalibrating("the head was given a target meanwhile; start again");
  exploring_ = false;
  target_ = target;
  return absl::OkStatus();
}

void GazeLoop::StopCalibrating(const char* why) {
  if (!calibration_.running()) return;
  calibration_.Abandon(why);
  controller_.LoseSync();
}

absl::Status GazeLoop::Carry(SteerGaze::What what, Timestamp now_ns) {
  StopCalibrating("the head was told something else meanwhile; start again");
  target_.reset();
  exploring_ = false;
  switch (what) {
    case SteerGaze::What::kRelease:
      controller_.Idle();
      exploring_ = options_.explore_when_idle;
      break;
    case SteerGaze::What::kHome:
      controller_.Home();
      break;
    case SteerGaze::What::kStop:
      controller_.Stop();
      break;
    case SteerGaze::What::kHorizon:
      controller_.KeepHorizon();
      break;
    case SteerGaze::What::kExplore:
      controller_.Idle();
      exploring_ = true;
      break;
    case SteerGaze::What::kCalibrate:
      controller_.Idle();
      return calibration_.Begin(now_ns);
  }
  return absl::OkStatus();
}

void GazeLoop::Steer(const SteerGaze& command, Timestamp now_ns) {
  // The wearer stops the head whoever pilots.
  const bool always = command.caller.wearer && command.what == SteerGaze::What::kStop;
  absl::Status may = always ? absl::OkStatus() : arbiter_.MaySteer(command.caller, now_ns);
  if (may.ok()) may = Carry(command.what, now_ns);
  Publish(now_ns);
  if (!may.ok()) return command.done(may);
  command.done(snapshot_);
}

void GazeLoop::Execute(const GazeCommand& command, Timestamp now_ns) {
  if (const auto* acquire = std::get_if<AcquireGazeLease>(&command)) {
    absl::StatusOr<LeaseAnswer> answer =
        arbiter_.Acquire(acquire->caller, acquire->lease_id, now_ns);
    React(now_ns);
    Publish(now_ns);
    acquire->done(std::move(answer));
  } else if (const auto* release = std::get_if<ReleaseGazeLease>(&command)) {
    const absl::Status released = arbiter_.Release(release->caller, now_ns);
    React(now_ns);
    Publish(now_ns);
    release->done(released);
  } else if (const auto* fixate = std::get_if<FixateGaze>(&command)) {
    absl::Status done = arbiter_.MaySteer(fixate->caller, now_ns);
    if (done.ok()) done = Fixate(fixate->target, fixate->fast);
    Publish(now_ns);
    if (!done.ok()) return fixate->done(done);
    fixate->done(snapshot_);
  } else if (const auto* steer = std::get_if<SteerGaze>(&command)) {
    Steer(*steer, now_ns);
  } else if (const auto* override = std::get_if<OverrideGaze>(&command)) {
    const absl::Status taken = arbiter_.Override(override->caller, override->enabled, now_ns);
    React(now_ns);
    Publish(now_ns);
    override->done(taken);
  } else {
    const auto& pause = std::get<PauseGaze>(command);
    const absl::Status paused = arbiter_.Pause(pause.caller, pause.paused);
    if (paused.ok() && pause.paused) Carry(SteerGaze::What::kStop, now_ns).IgnoreError();
    Publish(now_ns);
    pause.done(paused);
  }
}

// What the head does when it changes hands: nothing of the last pilot's goes on.
void GazeLoop::React(Timestamp now_ns) {
  for (Handover& change : arbiter_.TakeHandovers()) {
    if (change.why == Handover::Why::kVanished && !change.to) {
      Carry(SteerGaze::What::kRelease, now_ns).IgnoreError();
      exploring_ = false;
      controller_.Park();
    } else if (change.why == Handover::Why::kGranted) {
      exploring_ = false;  // a pilot starts from a head at rest
      if (controller_.report().mode == GazeMode::kExplore) controller_.Idle();
    } else if (change.why == Handover::Why::kReleased && !change.to) {
      Carry(SteerGaze::What::kRelease, now_ns).IgnoreError();
    } else {
      Carry(SteerGaze::What::kStop, now_ns).IgnoreError();
    }
    handovers_.push_back(std::move(change));
  }
}

std::vector<Handover> GazeLoop::TakeHandovers() { return std::exchange(handovers_, {}); }

void GazeLoop::OnView(const GazeView& view) {
  if (view_.map && view.map->map_generation != view_.map->map_generation) {
    controller_.ForgetMap();
    if (target_ && !std::holds_alternative<GazeAnnotation>(*target_)) target_.reset();
  }
  view_ = view;
  // Meanwhile nobody knows how the joints turn the camera.
  if (calibration_.running()) return calibration_.OnView(*view.map);
  controller_.SetDown(view.down_in_world);
  const TrackingStatus status = view.map->status;
  if (view.angles && (status == TrackingStatus::kTracking || status == TrackingStatus::kCoasting ||
                      FollowsTurns(*view.map))) {
    controller_.ObservePose(
        {view.map->capture_time_ns, view.map->world_from_camera, *view.angles, HasPose(*view.map)});
  }
  if (target_) controller_.UpdateTarget(PointOf(*target_));
}

void GazeLoop::Explore(Timestamp now_ns) {
  const bool looking = controller_.report().mode == GazeMode::kExplore;
  if (looking && looked_since_ns_ &&
      Seconds(now_ns - *looked_since_ns_) < options_.explore_dwell_s) {
    return;
  }
  const std::optional<Rigid3> wearer = controller_.WorldFromMount(now_ns);
  if (!view_.map || !wearer) return;
  const std::optional<Eigen::Vector3d> point =
      explorer_.Choose(*view_.map, *wearer, mount_.model());
  if (!point) return;
  looked_since_ns_ = now_ns;
  controller_.Fixate(*point, /*fast=*/false, GazeMode::kExplore).IgnoreError();
}

void GazeLoop::Step(Timestamp now_ns) {
  arbiter_.Tick(now_ns);
  React(now_ns);
  if (calibration_.running()) {
    calibration_.Step(now_ns);
    if (!calibration_.running()) controller_.LoseSync();
    return Publish(now_ns);
  }
  if (exploring_ && !arbiter_.paused()) Explore(now_ns);
  const MountDemand demand = controller_.Step(now_ns, mount_.Newest(), mount_.status());
  // A refusal is in the status, which the controller has just read.
  mount_.Send(demand).IgnoreError();
  Publish(now_ns);
}

void GazeLoop::Publish(Timestamp now_ns) {
  auto snapshot = std::make_shared<GazeSnapshot>();
  const GazeReport& report = controller_.report();
  snapshot->mode = report.mode;
  snapshot->time_ns = now_ns;
  if (const auto reading = mount_.Newest()) snapshot->joints_rad = ToVector(reading->angles);
  snapshot->target = target_;
  snapshot->target_in_world = report.target_in_world;
  snapshot->error_rad = report.error_rad;
  snapshot->arrived = report.arrived;
  snapshot->target_lost = report.target_lost;
  snapshot->reachable = report.reachable;
  snapshot->miss_rad = report.miss_rad;
  snapshot->fast = report.fast;
  snapshot->guidance_rad = report.guidance_rad;
  snapshot->world_from_view = report.world_from_view;
  snapshot->problem = report.problem;
  snapshot->calibration = calibration_.report();
  if (calibration_.running()) {
    snapshot->problem = absl::StrFormat("the mount is being calibrated, %.0f %%: stand still",
                                        100 * snapshot->calibration->share);
  }
  snapshot->pilot = arbiter_.pilot();
  snapshot->queue = arbiter_.queue();
  snapshot->paused = arbiter_.paused();
  snapshot->handovers = arbiter_.handovers();
  snapshot->last_handover = arbiter_.last_words();
  snapshot_ = std::move(snapshot);
  if (listener_) listener_(snapshot_);
}

}  // namespace saccade
