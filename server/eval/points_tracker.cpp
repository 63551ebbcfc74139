#include "server/eval/points_tracker.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace saccade {
namespace {

constexpr double kStartPosition_m = 0.01, kStartRotation_rad = 0.01;
constexpr double kStartVelocity_m_s = 0.05, kStartAngularVelocity_rad_s = 0.05;

CameraMotion TrueMotion(const PointsFrame& frame) {
  return {frame.world_from_camera, frame.velocity_in_world, frame.angular_velocity_in_camera, {}};
}

/// Off the truth by what its sigmas say.
StartPose DrawStart(const PointsFrame& first, std::uint64_t seed) {
  std::mt19937_64 random(seed ^ 0x5acadeULL);
  std::normal_distribution<double> normal;
  Vector12d error;
  for (int i = 0; i < error.size(); ++i) {
    constexpr double kSigma[] = {kStartPosition_m, kStartRotation_rad, kStartVelocity_m_s,
                                 kStartAngularVelocity_rad_s};
    error[i] = kSigma[i / 3] * normal(random);
  }
  const CameraMotion motion = Plus(TrueMotion(first), error);
  return {.world_from_camera = motion.world_from_camera,
          .position_sigma_m = kStartPosition_m,
          .orientation_sigma_rad = kStartRotation_rad,
          .velocity_m_s = motion.velocity_m_s,
          .velocity_sigma_m_s = kStartVelocity_m_s,
          .angular_velocity_rad_s = motion.angular_velocity_rad_s,
          .angular_velocity_sigma_rad_s = kStartAngularVelocity_rad_s};
}

SourceInfo MakeSource(const PointsWorld& world, const PointsOptions& options, bool known_map,
                      const PointsFrame& first) {
  SourceInfo source;
  source.uri = "points";
  source.camera = std::make_shared<CameraModel>(world.camera);
  PatchTarget target;
  const int known = known_map ? static_cast<int>(world.points.size()) : options.target_points;
  for (int i = 0; i < known; ++i) {
    target.points.push_back({i, world.points[static_cast<std::size_t>(i)], {}});
  }
  source.target = std::move(target);
  source.start = DrawStart(first, options.seed);
  return source;
}

}  // namespace

PointsSetup MakePointsSetup(const PointsOptions& options) {
  PointsSetup setup;
  TrackerOptions& tracker = setup.tracker;
  tracker.seed = options.seed;
  tracker.acceleration_sigma_m_s2 = options.linear_sigma;
  tracker.angular_acceleration_sigma_rad_s2 = options.angular_sigma;
  tracker.pixel_sigma_px = options.noise_px;
  tracker.pixel_sigma_growth = 0.0;
  tracker.readout_sigma_s = 0.0;
  tracker.features_in_view = 40;
  tracker.max_features = 100;
  return setup;
}

PointsSetup MakeConsistencySetup(const PointsOptions& options) {
  PointsSetup setup = MakePointsSetup(options);
  setup.tracker.home_share = 0.0;
  setup.tracker.robust = false;
  setup.tracker.adjust = false;
  return setup;
}

absl::StatusOr<PointsTracker> PointsTracker::Create(const PointsWorld& world,
                                                    const PointsOptions& options,
                                                    const PointsSetup& setup,
                                                    const PointsFrame& first) {
  auto front_end = std::make_unique<PointsFrontEnd>(world, options);
  PointsFrontEnd& points = *front_end;
  const SourceInfo source = MakeSource(world, options, setup.known_map, first);
  auto tracker = Tracker::Create(source, setup.tracker, std::move(front_end));
  if (!tracker.ok()) return tracker.status();
  return PointsTracker(world, *std::move(tracker), points, source);
}

PointsTracker::PointsTracker(const PointsWorld& world, std::unique_ptr<Tracker> tracker,
                             PointsFrontEnd& front_end, const SourceInfo& source)
    : world_(&world), front_end_(&front_end), tracker_(std::move(tracker)) {
  frame_.camera = source.camera;
}

absl::StatusOr<PointsStep> PointsTracker::Step(const PointsFrame& frame) {
  front_end_->Show(frame);
  frame_.id = static_cast<FrameId>(steps_);
  frame_.capture_time_ns = static_cast<Timestamp>(std::llround(1e9 * world_->dt_s * steps_));
  ++steps_;
  const auto snapshot = tracker_->Track(frame_);
  const FilterState& filter = tracker_->filter();
  PointsStep step;
  step.nis = tracker_->nis();
  step.matches = snapshot->matched;
  const Vector12d error = Minus(TrueMotion(frame), filter.camera());
  const Eigen::LDLT<Matrix6d> covariance(filter.PoseCovariance());
  if (!error.allFinite() || covariance.info() != Eigen::Success || !covariance.isPositive()) {
    return absl::FailedPreconditionError(
        absl::StrCat("frame ", frame_.id, ": the pose covariance is not positive definite"));
  }
  step.nees = error.head<6>().dot(covariance.solve(error.head<6>()));
  const Eigen::Matrix3d of_position = filter.PoseCovariance().topLeftCorner<3, 3>();
  step.position_nees = error.head<3>().dot(of_position.ldlt().solve(error.head<3>()));
  step.position_error_m = error.head<3>().norm();
  step.rotation_error_rad = error.segment<3>(3).norm();
  return step;
}

}  // namespace saccade
