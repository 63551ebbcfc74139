#include "server/mount/drivers/threaded_mount.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace saccade {

ThreadedMount::ThreadedMount(const MountOptions& mount, const ThreadedMountOptions& options,
                             const MountStatus& status)
    : model_(mount),
      retry_s_(options.retry_s),
      max_retry_s_(options.max_retry_s),
      silent_s_(options.silent_s),
      encoders_(options.encoders),
      health_(status.health),
      problem_(status.problem) {}

void ThreadedMount::Start() {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

void ThreadedMount::End() {
  thread_.request_stop();
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

absl::Status ThreadedMount::Send(const MountDemand& demand) {
  if (!demand.angles_rad.allFinite() || !demand.rates_rad_s.allFinite() ||
      !(demand.rate_limits_rad_s.minCoeff() >= 0)) {
    return absl::InvalidArgumentError("mount: the demanded angles or rates are not finite");
  }
  const std::lock_guard lock(mutex_);
  if (health_ == MountHealth::kDisconnected) return absl::UnavailableError(problem_);
  demand_ = demand;
  demanded_ns_ = MonotonicNow();
  brake_ = false;
  return absl::OkStatus();
}

void ThreadedMount::Stop() {
  const std::lock_guard lock(mutex_);
  if (!demand_) return;
  demand_.reset();
  brake_ = true;
}

std::optional<EncoderReading> ThreadedMount::Newest() const {
  const std::lock_guard lock(mutex_);
  if (Seconds(MonotonicNow() - read_ns_) > silent_s_) return std::nullopt;
  return encoders_.Newest();
}

std::optional<EncoderReading> ThreadedMount::LastReading() const {
  const std::lock_guard lock(mutex_);
  return encoders_.Newest();
}

std::optional<MountAngles> ThreadedMount::AnglesAt(Timestamp time_ns) const {
  const std::lock_guard lock(mutex_);
  return encoders_.At(time_ns);
}

MountStatus ThreadedMount::status() const {
  const std::lock_guard lock(mutex_);
  return {health_, problem_, health_ != MountHealth::kDisconnected && !demand_};
}

std::optional<ThreadedMount::Goal> ThreadedMount::Demanded(double ahead_s) const {
  const std::lock_guard lock(mutex_);
  if (!demand_) return std::nullopt;
  const double age_s = Seconds(MonotonicNow() - demanded_ns_) + ahead_s;
  return Goal{demand_->angles_rad + std::min(age_s, kDemandHeld_s) * demand_->rates_rad_s,
              demand_->rate_limits_rad_s};
}

bool ThreadedMount::TakeBrake() {
  const std::lock_guard lock(mutex_);
  return std::exchange(brake_, false);
}

void ThreadedMount::AddReading(Timestamp time_ns, const Eigen::Vector3d& angles_rad) {
  const auto delay = static_cast<Timestamp>(std::llround(1e9 * model_.options().encoder_delay_s));
  const std::lock_guard lock(mutex_);
  encoders_.Add({time_ns - delay, ToAngles(angles_rad)});
  read_ns_ = time_ns;
  has_reading_ = true;
}

void ThreadedMount::Report(const std::string& problem) {
  const std::lock_guard lock(mutex_);
  health_ = problem.empty() ? MountHealth::kReady : MountHealth::kFault;
  problem_ = problem.empty() ? "" : absl::StrCat("mount: ", problem);
}

void ThreadedMount::Lose(const std::string& problem) {
  const std::lock_guard lock(mutex_);
  health_ = MountHealth::kDisconnected;
  problem_ = absl::StrCat("mount: ", problem);
  // Whatever was demanded before is old when it is back.
  demand_.reset();
  brake_ = false;
  encoders_.Clear();
}

bool ThreadedMount::WaitUntil(Clock::time_point time, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

void ThreadedMount::Run(const std::stop_token& stop) {
  double retry_s = retry_s_;
  while (!stop.stop_requested()) {
    has_reading_ = false;
    const absl::Status ended = Session(stop);
    if (stop.stop_requested()) return;
    Lose(std::string(ended.message()));
    if (has_reading_) retry_s = retry_s_;
    const auto wait = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * retry_s));
    if (!WaitUntil(Clock::now() + wait, stop)) return;
    retry_s = std::min(2 * retry_s, max_retry_s_);
  }
}

}  // namespace saccade
