// The part of the tracker that begins: with a target, or without one (slam-spec 7).
#include "server/pipeline/stop_watch.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

// What is known of the camera between the newest keyframe of the start and this frame.
constexpr double kPositionShare = 0.05;  // of the distance to what is in view
constexpr double kAngleSigma_rad = 0.05;
constexpr double kVelocityShare_1_s = 0.3;
constexpr double kAngularVelocitySigma_rad_s = 0.5;
// Of the newest frame's searches, that a start must explain: good ones have 79 to 99 %. With 38 to
// 74 % the map was up to 40 cm off (`hall_imu` at 10 pictures a second).
constexpr double kAgreeing = 0.75;

}  // namespace

void Tracker::Begin(const Frame& frame) {
  StopWatch watch;
  matches_ = FrameMatches();
  if (StudiesLens()) {
    monitor_.WaitForStart();
    return;
  }
  std::optional<Start> start;
  if (squares_ && squares_->has_known()) start = StartBySquares(frame);
  if (!start && !WaitsForSquares()) {
    start = starter_.Try(*front_end_, filter_, map_.in_use());
  }
  times_.search_ms = watch.Lap_ms();
  if (!start) {
    monitor_.WaitForStart();
    return;
  }
  metric_ = start->metric;
  held_ = metric_ || !options_.start;
  depth_ = start->depth;
  matches_ =
      matcher_.Match(*front_end_, *frame.camera, filter_, map_.in_use(), MotionStep(), random_);
  Grow(frame, /*everywhere=*/true);
  started_ = filter_.feature_count() > 0 || !map_.in_use().all().empty();
  times_.manage_ms = watch.Lap_ms();
  if (!started_) return;  // nothing to see at all: try again with the next frame
  frames_ = 0;
  // Features that are born in this frame are seen in it.
  const int born = static_cast<int>(filter_.feature_count());
  matches_.attempted += born;
  matches_.accepted += born;
  if (held_) {
    KeepForAdjustment(frame);
  } else {
    finder_.Record(frame.capture_time_ns, *frame.camera, filter_, map_.in_use(), matches_);
  }
  if (metric_) monitor_.Record(matches_.attempted, matches_.accepted, true);
}

void Tracker::SeekStart(const Frame& frame) {
  finder_.Record(frame.capture_time_ns, *frame.camera, filter_, map_.in_use(), matches_);
  const auto found = finder_.Finish(frames_);
  times_.waited_ms += finder_.waited_ms();
  if (found) {
    TakeOver(*found, frame);
    if (matches_.accepted < kAgreeing * matches_.attempted) StartAnew(frame);
  } else {
    finder_.Start(frames_, filter_);
  }
}

void Tracker::TakeOver(const FoundStart& start, const Frame& frame) {
  const double unit = 1.0 / start.inverse_range;
  const double elapsed = Seconds(frame.capture_time_ns - start.newest_time_ns);
  CameraMotion motion = filter_.WholeMotion();
  const Rigid3 since = start.newest_before.Inverse() * motion.world_from_camera;
  motion.world_from_camera = {(start.newest.rotation * since.rotation).normalized(),
                              start.newest.translation + elapsed * start.velocity};
  motion.velocity_m_s = start.velocity;
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(kPositionShare * unit + 0.5 * elapsed * start.velocity.norm()),
      Eigen::Vector3d::Constant(kAngleSigma_rad),
      Eigen::Vector3d::Constant(kVelocityShare_1_s * unit),
      Eigen::Vector3d::Constant(kAngularVelocitySigma_rad_s);
  const std::vector<CloneId> clones =
      filter_.Seed(start.seed, motion, sigma.cwiseAbs2().asDiagonal());
  home_ = clones.front();
  map_.BeginAnew(filter_);
  loops_.Reset();  // it reads the relocaliser
  relocaliser_.Clear();
  refiner_.Reset();
  for (const FoundStart::Keyframe& keyframe : start.keyframes) {
    if (!options_.adjust) break;
    std::optional<CloneId> clone;
    if (keyframe.anchor >= 0) clone = clones[static_cast<std::size_t>(keyframe.anchor)];
    map_.TakeKeyframe(keyframe.world_from_camera, unit, keyframe.sightings, keyframe.births, clone);
  }
  std::erase_if(matches_.in_view,
                [&](const LandmarkMatch& match) { return !filter_.Has(match.id); });
  matcher_.Renew(*frame.camera, filter_, matches_, random_);
  Correct(*frame.camera);
  depth_ = {start.inverse_range, 0.5 * start.inverse_range};
  held_ = true;
  finder_.Reset();
  ++revision_;
  if (squares_) StartSquares(start);
}

}  // namespace saccade
