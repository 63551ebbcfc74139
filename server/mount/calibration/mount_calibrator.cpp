#include "server/mount/calibration/mount_calibrator.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr double kAfterwards_s = 0.7;  // readings past the last picture, pictures on their way

}  // namespace

double MountCalibrator::Share(Timestamp now_ns) const {
  return std::clamp(Seconds(now_ns - begin_ns_) / (schedule_.duration_s() + kAfterwards_s), 0.0,
                    1.0);
}

bool MountCalibrator::Done(Timestamp now_ns) const {
  return Seconds(now_ns - begin_ns_) >= schedule_.duration_s() + kAfterwards_s;
}

MountDemand MountCalibrator::Demand(Timestamp now_ns) {
  const MountDemand demand = schedule_.At(Seconds(now_ns - begin_ns_));
  data_.demands.push_back({now_ns, demand.angles_rad});
  return demand;
}

void MountCalibrator::Add(const EncoderReading& reading) {
  if (!data_.readings.empty() && reading.time_ns <= data_.readings.back().time_ns) return;
  data_.readings.push_back(reading);
}

}  // namespace saccade
