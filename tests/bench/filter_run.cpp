#include "tests/bench/filter_run.hpp"

#include <cmath>

#include "server/filter/robust_pose.hpp"
#include "tests/bench/bench.hpp"

namespace saccade {
namespace {

constexpr std::size_t kFirstBirths = 60;     // in one clone, as the tracker starts
constexpr std::size_t kBirthsPerClone = 15;  // afterwards (slam-spec 5.4)
constexpr int kBirthEvery = 5;               // frames, until all features are born
constexpr int kWarmUp = 120;                 // updates; past the first-estimates ones of a map
constexpr double kNoise_px = 0.5;
constexpr double kRelativeDepthSigma = 0.1;
constexpr double kFrame_s = 1.0 / 30.0;

CameraModel Lens() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 457.0;
  lens.cx = 319.5;
  lens.cy = 239.5;
  lens.distortion = {-0.12, 0.03, 0, 0, 0};
  return CameraModel(lens);
}

/// Somebody who sways by a few centimetres before things 1 to 4 m away, all of them always in view.
Rigid3 Sway(double t) {
  return {ExpQuaternion({0.04 * std::sin(1.1 * t), 0.05 * std::sin(0.9 * t), 0.05 * std::sin(t)}),
          {0.12 * std::sin(0.8 * t), 0.06 * std::sin(1.3 * t), 0.08 * std::sin(0.6 * t)}};
}

}  // namespace

FilterRun::FilterRun(int features, FilterState& filter, RobotId robot, FeatureId first_id)
    : lens_(Lens()), filter_(filter), robot_(robot), first_id_(first_id), random_(7) {
  std::uniform_real_distribution<double> u(150, 490), v(120, 360), range(1.0, 4.0);
  for (int k = 0; k < features; ++k) {
    const Eigen::Vector2d pixel(u(random_), v(random_));
    points_.push_back(range(random_) * *lens_.Unproject(pixel));
  }
}

FilterOptions FilterRun::Options(PointForm form) {
  FilterOptions options;
  options.form = form;
  options.readout_sigma_s = 0.015;
  return options;
}

Matrix12d FilterRun::StartCovariance() {
  Vector12d sigma = Vector12d::Zero();
  sigma.segment<3>(6).setConstant(0.1);
  sigma.tail<3>().setConstant(0.1);
  return sigma.cwiseAbs2().asDiagonal();
}

absl::Status FilterRun::Step(std::array<double, kFilterStages>& ms) {
  truth_ = Sway(kFrame_s * ++frame_);
  const std::vector<Observation> seen = See();
  StopWatch watch;
  filter_.Predict(kFrame_s, MotionNoise(), nullptr, robot_);
  ms[kPredict] = watch.Lap_ms();
  std::vector<PoseEvidence> evidence;
  evidence.reserve(seen.size());
  for (const Observation& each : seen) {
    const auto predicted = filter_.Predicted(lens_, each.id, robot_);
    if (!predicted) return absl::InternalError("bench filter: a feature left the view");
    evidence.push_back({filter_.Point(each.id), *predicted, each.pixel, each.noise});
  }
  ms[kPredictions] = watch.Lap_ms();
  const PosePrior prior = {filter_.camera(robot_).world_from_camera,
                           filter_.PoseCovariance(robot_)};
  const RobustPose pose = EstimateRobustPose(lens_, prior, evidence, RobustPoseOptions(), random_);
  ms[kRobustPose] = watch.Lap_ms();
  const auto report = filter_.Update(lens_, seen, pose.world_from_camera, robot_);
  ms[kUpdate] = watch.Lap_ms();
  ms[kAll] = ms[kPredict] + ms[kPredictions] + ms[kRobustPose] + ms[kUpdate];
  if (!report.ok()) return report.status();
  return Birth();
}

absl::Status FilterRun::WarmUp() {
  std::array<double, kFilterStages> ms{};
  for (int k = 0; !complete() || k < kWarmUp; ++k) {
    if (const absl::Status status = Step(ms); !status.ok()) return status;
  }
  return absl::OkStatus();
}

double FilterRun::PositionError() const {
  return (filter_.camera(robot_).world_from_camera.translation - truth_.translation).norm();
}

Eigen::Vector2d FilterRun::PixelOf(std::size_t point) {
  const Eigen::Vector2d exact = *lens_.Project(truth_.Inverse() * points_[point]);
  const double du = kNoise_px * normal_(random_), dv = kNoise_px * normal_(random_);
  return exact + Eigen::Vector2d(du, dv);
}

std::vector<Observation> FilterRun::See() {
  std::vector<Observation> seen;
  for (std::size_t k = 0; k < born_; ++k) {
    Observation observation;
    observation.id = first_id_ + k;
    observation.pixel = PixelOf(k);
    observation.noise = kNoise_px * kNoise_px * Eigen::Matrix2d::Identity();
    seen.push_back(observation);
  }
  return seen;
}

absl::Status FilterRun::Birth() {
  if (complete() || frame_ % kBirthEvery != 1) return absl::OkStatus();
  const CloneId clone = filter_.AddClone(robot_);
  const std::size_t births = born_ == 0 ? kFirstBirths : kBirthsPerClone;
  for (std::size_t k = 0; k < births && !complete(); ++k) {
    FeatureBirth birth;
    Eigen::Matrix<double, 3, 2> d_bearing;
    birth.id = first_id_ + born_;
    birth.bearing = *lens_.Unproject(PixelOf(born_), &d_bearing);
    birth.bearing_covariance = kNoise_px * kNoise_px * d_bearing * d_bearing.transpose();
    // Depths roughly known: not how starts go is measured here, but what updates cost.
    const double inverse_range = 1.0 / (truth_.Inverse() * points_[born_]).norm();
    birth.inverse_range_sigma = kRelativeDepthSigma * inverse_range;
    birth.inverse_range = inverse_range + birth.inverse_range_sigma * normal_(random_);
    if (const absl::Status status = filter_.AddFeature(clone, birth); !status.ok()) return status;
    ++born_;
  }
  return absl::OkStatus();
}

}  // namespace saccade
