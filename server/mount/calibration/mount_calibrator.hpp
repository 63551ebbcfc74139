#pragma once

#include <absl/status/statusor.h>

#include "server/mount/calibration/calibration_schedule.hpp"
#include "server/mount/calibration/mount_calibration.hpp"

namespace saccade {

/// One calibration of a mount: what to demand, and what was seen meanwhile. Explicit time; one
/// thread.
class MountCalibrator {
 public:
  MountCalibrator(const MountOptions& present, Timestamp now_ns, const MountAngles& start)
      : present_(present), schedule_(present, start), begin_ns_(now_ns) {}

  /// 0 to 1.
  double Share(Timestamp now_ns) const;
  /// Also of pictures that are still on their way.
  bool Done(Timestamp now_ns) const;
  /// What to Send now; it is remembered.
  MountDemand Demand(Timestamp now_ns);
  void Add(const EncoderReading& reading);
  void Add(const CalibrationData::Picture& picture) { data_.pictures.push_back(picture); }
  void SetMetric(bool metric) { data_.metric = metric; }

  /// Takes a quarter of a second.
  absl::StatusOr<MountCalibration> Solve() const { return CalibrateMount(data_, present_); }

 private:
  const MountOptions present_;
  const CalibrationSchedule schedule_;
  const Timestamp begin_ns_;
  CalibrationData data_;
};

}  // namespace saccade
