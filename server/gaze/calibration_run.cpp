#include "server/gaze/calibration_run.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "server/mount/mount_options.hpp"

namespace saccade {
namespace {

MountCalibrationReport ReportOf(const MountCalibration& found) {
  MountCalibrationReport report;
  report.running = false;
  report.share = 1;
  report.toml = ToToml(found.mount);
  report.orientation_rms_before_rad = found.orientation_rms_before_rad;
  report.orientation_rms_rad = found.orientation_rms_rad;
  report.orientation_max_rad = found.orientation_max_rad;
  report.position_rms_m = found.position_rms_m;
  report.encoder_delay_s = found.encoder_delay_s;
  report.command_latency_s = found.command_latency_s;
  report.pictures = found.pictures;
  report.outliers = found.outliers;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const MountCalibration::Joint& joint = found.joints[k];
    report.joints.push_back({.name = ToString(static_cast<MountJoint>(k)),
                             .moved = joint.moved,
                             .range_rad = joint.range_rad,
                             .turned_rad = joint.turned_rad,
                             .axis_sigma_rad = joint.axis_sigma_rad,
                             .sign_flipped = joint.sign_flipped,
                             .zero_shift_rad = joint.zero_shift_rad});
  }
  return report;
}

}  // namespace

absl::Status CalibrationRun::Begin(Timestamp now_ns) {
  const MountStatus status = mount_.status();
  const std::optional<EncoderReading> reading = mount_.Newest();
  if (status.health != MountHealth::kReady || !reading) {
    return absl::FailedPreconditionError(absl::StrCat(
        "calibrate-mount: the mount is not ready",
        status.problem.empty() ? "; wait for its readings" : absl::StrCat(": ", status.problem)));
  }
  calibrator_ =
      std::make_unique<MountCalibrator>(mount_.model().options(), now_ns, reading->angles);
  phase_ = Phase::kMoving;
  map_generation_.reset();
  report_ = std::make_shared<const MountCalibrationReport>();
  return absl::OkStatus();
}

void CalibrationRun::Abandon(const std::string& why) {
  if (!running()) return;
  MountCalibrationReport report = *report_;
  report.running = false;
  report.problem = absl::StrCat("calibrate-mount: ", why);
  report_ = std::make_shared<const MountCalibrationReport>(std::move(report));
  phase_ = Phase::kIdle;
  calibrator_.reset();
  mount_.Stop();
}

void CalibrationRun::OnView(const MapSnapshot& map) {
  if (phase_ != Phase::kMoving) return;
  if (map_generation_ && *map_generation_ != map.map_generation) {
    return Abandon("the map was reset meanwhile; start again");
  }
  map_generation_ = map.map_generation;
  if (map.status != TrackingStatus::kTracking) return;
  calibrator_->SetMetric(map.metric);
  const Eigen::Matrix<double, 6, 1> variances = map.pose_covariance.diagonal();
  calibrator_->Add(CalibrationData::Picture{
      .time_ns = map.capture_time_ns,
      .world_from_camera = map.world_from_camera,
      .rotation_sigma_rad = std::sqrt(std::max(0.0, variances.tail<3>().mean())),
      .position_sigma_m = std::sqrt(std::max(0.0, variances.head<3>().mean()))});
}

void CalibrationRun::Step(Timestamp now_ns) {
  if (phase_ == Phase::kSolving) {
    if (solution_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      Finish(solution_.get());
    }
    return;
  }
  if (phase_ != Phase::kMoving) return;
  const MountStatus status = mount_.status();
  if (status.health != MountHealth::kReady) return Abandon(status.problem);
  if (const std::optional<EncoderReading> reading = mount_.Newest()) calibrator_->Add(*reading);
  if (calibrator_->Done(now_ns)) {
    phase_ = Phase::kSolving;
    solution_ =
        std::async(std::launch::async, [all = std::move(calibrator_)] { return all->Solve(); });
    return;
  }
  mount_.Send(calibrator_->Demand(now_ns)).IgnoreError();  // a refusal is in the status
  MountCalibrationReport report;
  report.share = calibrator_->Share(now_ns);
  report_ = std::make_shared<const MountCalibrationReport>(std::move(report));
}

void CalibrationRun::Finish(const absl::StatusOr<MountCalibration>& found) {
  phase_ = Phase::kIdle;
  MountCalibrationReport report;
  if (found.ok()) {
    report = ReportOf(*found);
  } else {
    report.running = false;
    report.share = 1;
    report.problem = std::string(found.status().message());
  }
  report_ = std::make_shared<const MountCalibrationReport>(std::move(report));
}

}  // namespace saccade
