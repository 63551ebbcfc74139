#include "server/gaze/gaze_controller.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr double kMaxStep_s = 0.05;
// By how much a pose may differ from the expected one, at once and for each second since the last:
// beyond any wearer's acceleration.
constexpr double kJump_rad = 4 * kDegree, kJumpRate_rad_s = 20 * kDegree;
constexpr double kJump_m = 0.10, kJumpRate_m_s = 0.5;
constexpr double kLongestSaccade_s = 2.0;    // encoders and the wearer's inertia serve for so long
constexpr double kCatchUp = 1.02;            // of the rate limit, for servos that lag behind
constexpr Timestamp kRateSpan = 20'000'000;  // over which a moving goal's rate is taken

Timestamp Nanoseconds(double seconds) {
  return static_cast<Timestamp>(std::llround(1e9 * seconds));
}

bool LooksAtTarget(GazeMode mode) {
  return mode == GazeMode::kSaccade || mode == GazeMode::kFixate || mode == GazeMode::kExplore;
}

}  // namespace

GazeController::GazeController(const MountModel& model, const GazeOptions& options)
    : model_(model), options_(options), wearer_(options.pose_window_s) {}

void GazeController::SetMode(GazeMode mode) {
  const std::string problem = report_.problem;
  report_ = {};
  report_.mode = mode;
  report_.problem = problem;
  report_.fast = fast_;
  within_since_ns_.reset();
}

absl::Status GazeController::Fixate(const Eigen::Vector3d& point_in_world, bool fast,
                                    GazeMode mode) {
  if (!point_in_world.allFinite()) {
    return absl::InvalidArgumentError("target: a coordinate is not a finite number");
  }
  if (const std::optional<Rigid3> wearer = wearer_.Newest()) {
    const double distance = (point_in_world - wearer->translation).norm();
    if (distance > options_.max_target_distance_m) {
      return absl::InvalidArgumentError(
          absl::StrFormat("target: %.1f m away; a target is at most %.0f m from the wearer",
                          distance, options_.max_target_distance_m));
    }
    if (distance < options_.min_target_distance_m) {
      return absl::InvalidArgumentError(
          absl::StrFormat("target: %.1f cm from the camera itself; give a point at least %.0f cm "
                          "away",
                          1e2 * distance, 1e2 * options_.min_target_distance_m));
    }
  }
  fast_ = fast;
  target_ = point_in_world;
  SetMode(mode);
  report_.target_in_world = target_;
  return absl::OkStatus();
}

void GazeController::UpdateTarget(const std::optional<Eigen::Vector3d>& point_in_world) {
  if (!LooksAtTarget(report_.mode)) return;
  const bool usable = point_in_world && point_in_world->allFinite();
  report_.target_lost = !usable;
  if (usable) report_.target_in_world = target_ = point_in_world;
}

void GazeController::KeepHorizon() {
  fast_ = false;
  SetMode(GazeMode::kHorizon);
  for (int k = 0; k < kMountJoints; ++k) {
    horizon_hold_(k) = axes_[static_cast<std::size_t>(k)].angle;
  }
}

void GazeController::Home() {
  fast_ = false;
  SetMode(GazeMode::kHome);
}

void GazeController::Park() {
  fast_ = false;
  SetMode(GazeMode::kParked);
}

void GazeController::Stop() { SetMode(GazeMode::kStopped); }

void GazeController::Idle() {
  fast_ = false;
  SetMode(GazeMode::kIdle);
}

void GazeController::ObservePose(const PoseObservation& pose) {
  const std::optional<PoseObservation> before = std::exchange(last_pose_, pose);
  if (before && pose.time_ns > before->time_ns) {
    const double rate = (ToVector(pose.angles) - ToVector(before->angles)).cwiseAbs().maxCoeff() /
                        Seconds(pose.time_ns - before->time_ns);
    // In a fast saccade pictures are blurred; encoders and the wearer's inertia know better.
    if (rate > options_.suspend_above_deg_s * kDegree) {
      carried_ns_ = pose.time_ns;
      return;
    }
  }
  if (!pose.sure) return;
  const Rigid3 base = pose.world_from_camera * model_.MountFromCamera(pose.angles).Inverse();
  if (Believable(pose.time_ns, base)) wearer_.Add(pose.time_ns, base);
}

bool GazeController::IsStale(Timestamp now_ns) const {
  const std::optional<Timestamp> newest = wearer_.newest_ns();
  if (!newest) return true;
  const bool carried = carried_ns_ > *newest && Seconds(carried_ns_ - *newest) < kLongestSaccade_s;
  return Seconds(now_ns - (carried ? carried_ns_ : *newest)) > options_.pose_stale_s;
}

bool GazeController::Believable(Timestamp time_ns, const Rigid3& world_from_mount) const {
  const std::optional<Rigid3> expected = wearer_.At(time_ns);
  if (!expected) return true;
  const double gap_s = Seconds(time_ns - *wearer_.newest_ns());
  if (gap_s > options_.insist_s) return true;
  const double turned = RotationAngle(*expected, world_from_mount);
  const double moved = (expected->translation - world_from_mount.translation).norm();
  return turned < kJump_rad + kJumpRate_rad_s * gap_s && moved < kJump_m + kJumpRate_m_s * gap_s;
}

void GazeController::ForgetMap() {
  last_pose_.reset();
  carried_ns_ = 0;
  wearer_.Clear();
  if (LooksAtTarget(report_.mode)) {
    Idle();
    report_.target_lost = true;
  }
  target_.reset();
}

AxisLimits GazeController::LimitsOf(int joint) const {
  const JointOptions& motor = model_.options().joints[static_cast<std::size_t>(joint)];
  AxisLimits limits;
  limits.least = motor.min_rad;
  limits.most = motor.max_rad;
  const bool quick = fast_ && report_.mode == GazeMode::kSaccade;
  const double rate =
      report_.mode == GazeMode::kParked ? options_.park_rate_deg_s : options_.rate_deg_s;
  // A fast saccade leaves the servos some of their strength to follow with.
  limits.rate = quick || report_.mode == GazeMode::kStopped
                    ? 0.97 * motor.max_rate_rad_s
                    : std::min(rate * kDegree, motor.max_rate_rad_s);
  limits.acceleration =
      fast_ ? 0.8 * motor.max_acceleration_rad_s2
            : std::min(options_.acceleration_deg_s2 * kDegree, motor.max_acceleration_rad_s2);
  limits.gain_per_s = quick ? options_.fast_gain_per_s : options_.gain_per_s;
  return limits;
}

double GazeController::Horizon_s() const {
  if (!options_.compensate_latency) return 0.0;
  return model_.options().command_latency_s + options_.servo_lag_s;
}

std::optional<FixationAngles> GazeController::AnglesFor(Timestamp time_ns,
                                                        const MountAngles& near) const {
  const std::optional<Rigid3> wearer =
      options_.compensate_latency ? wearer_.At(time_ns) : wearer_.Newest();
  if (!wearer) return std::nullopt;
  const Rigid3 mount_from_world = wearer->Inverse();
  std::optional<Eigen::Vector3d> down;
  if (down_) down = mount_from_world.rotation * *down_;
  if (report_.mode == GazeMode::kHorizon) {
    FixationAngles level;
    level.angles = ToAngles({horizon_hold_.x(), horizon_hold_.y(), near.cyclotorsion_rad});
    if (down) level.angles = model_.Level(*down, level.angles);
    return level;
  }
  return model_.Fixate(mount_from_world * *target_, down, near);
}

/// Where the joints should be when a command sent now takes effect, and how that moves.
std::optional<GazeController::Goal> GazeController::MovingGoal(Timestamp now_ns) {
  if (IsStale(now_ns)) {
    if (report_.problem.empty()) {
      report_.problem = "tracking is lost: the head rests until it is back";
    }
    return std::nullopt;
  }
  const Timestamp effect_ns = now_ns + Nanoseconds(Horizon_s());
  const MountAngles near = ToAngles({axes_[0].angle, axes_[1].angle, axes_[2].angle});
  const std::optional<FixationAngles> here = AnglesFor(effect_ns, near);
  if (!here) return std::nullopt;
  report_.reachable = here->reachable;
  report_.miss_rad = here->reachable ? 0.0 : here->miss_rad;
  Goal goal{ToVector(here->angles), Eigen::Vector3d::Zero()};
  const std::optional<FixationAngles> later = AnglesFor(effect_ns + kRateSpan, here->angles);
  if (options_.compensate_latency && later) {
    goal.rates = (ToVector(later->angles) - goal.angles) / Seconds(kRateSpan);
  }
  return goal;
}

std::optional<GazeController::Goal> GazeController::ChooseGoal(Timestamp now_ns) {
  switch (report_.mode) {
    case GazeMode::kSaccade:
    case GazeMode::kFixate:
    case GazeMode::kExplore:
    case GazeMode::kHorizon:
      return MovingGoal(now_ns);
    case GazeMode::kHome:
    case GazeMode::kParked:
      return Goal{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    default:
      return std::nullopt;
  }
}

/// After silence of the mount, and at the start, the joints are where the encoders say.
void GazeController::Resynchronise(const std::optional<EncoderReading>& encoder,
                                   const MountStatus& status) {
  if (status.health == MountHealth::kDisconnected) {
    synchronised_ = false;
    report_.problem = status.problem;
  }
  if (!synchronised_ && encoder && status.health != MountHealth::kDisconnected) {
    const Eigen::Vector3d angles = ToVector(model_.Clamp(encoder->angles));
    for (int k = 0; k < kMountJoints; ++k) {
      axes_[static_cast<std::size_t>(k)] = {.angle = angles(k), .rate = 0};
    }
    sent_.clear();
    behind_since_ns_.reset();
    synchronised_ = true;
  }
}

MountDemand GazeController::Step(Timestamp now_ns, const std::optional<EncoderReading>& encoder,
                                 const MountStatus& status) {
  report_.problem = status.problem;
  Resynchronise(encoder, status);
  const double since_s = last_ns_ ? Seconds(now_ns - *last_ns_) : 0.0;
  last_ns_ = now_ns;
  const double dt = std::clamp(since_s, 0.0, kMaxStep_s);
  const std::optional<Goal> goal = ChooseGoal(now_ns);
  const bool held = !synchronised_ && status.health == MountHealth::kDisconnected;
  MountDemand demand;
  for (int k = 0; k < kMountJoints; ++k) {
    AxisProfile& axis = axes_[static_cast<std::size_t>(k)];
    if (since_s > kMaxStep_s || held) axis.rate = 0;
    if (!held && goal) {
      axis.Follow(goal->angles(k), goal->rates(k), LimitsOf(k), dt);
    } else if (!held) {
      axis.Brake(LimitsOf(k), dt);
    }
    demand.angles_rad(k) = axis.angle;
    demand.rates_rad_s(k) = axis.rate;
    demand.rate_limits_rad_s(k) = kCatchUp * LimitsOf(k).rate;
  }
  report_.world_from_view.reset();
  if (const std::optional<Rigid3> wearer = wearer_.At(now_ns + Nanoseconds(Horizon_s()))) {
    report_.world_from_view =
        wearer->rotation * model_.MountFromCamera(ToAngles(demand.angles_rad)).rotation;
  }
  sent_.push_back({now_ns + Nanoseconds(model_.options().command_latency_s), demand.angles_rad});
  WatchFollowing(now_ns, encoder);
  Judge(now_ns, encoder);
  return demand;
}

void GazeController::WatchFollowing(Timestamp now_ns,
                                    const std::optional<EncoderReading>& encoder) {
  while (sent_.size() > 1 && sent_[1].effect_ns <= now_ns) sent_.pop_front();
  if (!encoder || !synchronised_ || sent_.front().effect_ns > encoder->time_ns + kRateSpan) {
    behind_since_ns_.reset();
    return;
  }
  const Eigen::Vector3d behind = (sent_.front().angles - ToVector(encoder->angles)).cwiseAbs();
  Eigen::Index worst = 0;
  // A rate of 300 deg/s puts 3 deg between two readings: fast motion is forgiven that.
  const double allowance = options_.not_following_deg * kDegree + 0.03 * std::abs(axes_[0].rate) +
                           0.03 * std::abs(axes_[1].rate);
  if (behind.maxCoeff(&worst) < allowance) {
    behind_since_ns_.reset();
    return;
  }
  if (!behind_since_ns_) behind_since_ns_ = now_ns;
  if (Seconds(now_ns - *behind_since_ns_) < options_.not_following_s) return;
  if (report_.problem.empty()) {
    report_.problem = absl::StrCat("mount: ", ToString(static_cast<MountJoint>(worst)),
                                   " does not follow: free the joint");
  }
}

void GazeController::Judge(Timestamp now_ns, const std::optional<EncoderReading>& encoder) {
  report_.error_rad.reset();
  report_.guidance_rad.reset();
  if (!LooksAtTarget(report_.mode) || !target_ || !encoder) {
    report_.arrived = false;
    return;
  }
  // Of the encoders' moment: nobody knows more of the present.
  const std::optional<Rigid3> wearer = wearer_.At(encoder->time_ns);
  const bool stale = IsStale(now_ns) || Seconds(now_ns - encoder->time_ns) > options_.pose_stale_s;
  if (!wearer || stale) {
    within_since_ns_.reset();
    report_.arrived = false;
    return;
  }
  const Eigen::Vector3d point_in_mount = wearer->Inverse() * *target_;
  report_.error_rad = model_.Miss(encoder->angles, point_in_mount);
  if (!report_.reachable) {
    const Eigen::Vector3d seen = model_.MountFromCamera(encoder->angles).Inverse() * point_in_mount;
    report_.guidance_rad = std::atan2(seen.y(), seen.x());
  }
  // Once there, it takes twice as much to be elsewhere: encoders and prediction are noisy.
  const double limit_deg = (report_.arrived ? 2.0 : 1.0) * options_.arrived_deg;
  if (*report_.error_rad > limit_deg * kDegree) {
    within_since_ns_.reset();
    report_.arrived = false;
    return;
  }
  if (!within_since_ns_) within_since_ns_ = now_ns;
  report_.arrived = Seconds(now_ns - *within_since_ns_) >= options_.arrived_s;
  if (report_.arrived && report_.mode == GazeMode::kSaccade) report_.mode = GazeMode::kFixate;
}

}  // namespace saccade
