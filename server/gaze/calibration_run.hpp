#pragma once

#include <absl/status/status.h>

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "server/mount/calibration/mount_calibrator.hpp"
#include "server/mount/mount.hpp"
#include "shared/scene/gaze.hpp"

namespace saccade {

/// calibrate-mount as part of gaze control: while it runs, it has the head. What it finds is
/// reported, not used: the model of a running server never changes. One thread; the solver, which
/// takes up to a second, has one of its own, so that nobody's heartbeat waits for it.
class CalibrationRun {
 public:
  /// `mount` outlives this.
  explicit CalibrationRun(Mount& mount) : mount_(mount) {}

  /// FailedPrecondition: the mount is not ready, or reads nothing.
  absl::Status Begin(Timestamp now_ns);
  bool running() const { return phase_ != Phase::kIdle; }
  /// Ends it without a result.
  void Abandon(const std::string& why);

  void OnView(const MapSnapshot& map);
  /// Demands the next place; at the end the head rests while the solver runs.
  void Step(Timestamp now_ns);

  /// Null: nobody has asked yet.
  std::shared_ptr<const MountCalibrationReport> report() const { return report_; }

 private:
  enum class Phase { kIdle, kMoving, kSolving };
  void Finish(const absl::StatusOr<MountCalibration>& found);

  Mount& mount_;
  Phase phase_ = Phase::kIdle;
  std::unique_ptr<MountCalibrator> calibrator_;  // while moving
  std::future<absl::StatusOr<MountCalibration>> solution_;
  std::optional<std::uint64_t> map_generation_;
  std::shared_ptr<const MountCalibrationReport> report_;
};

}  // namespace saccade
