#pragma once

#include <chrono>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/mount/encoder_ring.hpp"
#include "server/mount/mount.hpp"

namespace saccade {

struct ThreadedMountOptions {
  double retry_s = 0.2, max_retry_s = 2.0;  // between attempts to connect, doubled each time
  /// A reading older than this is none: the mount is silent.
  double silent_s = std::numeric_limits<double>::infinity();
  EncoderRing encoders = EncoderRing();
};

/// A mount that a thread of its own talks to: what gaze demands and what the encoders say meet
/// here, under one lock, and a lost connection is looked for with back-off. A driver is what
/// happens between a connection's beginning and its end: Session(). What is demanded before a loss
/// is forgotten with it.
class ThreadedMount : public Mount {
 public:
  const MountModel& model() const final { return model_; }
  absl::Status Send(const MountDemand& demand) final;
  void Stop() final;
  std::optional<EncoderReading> Newest() const final;
  std::optional<MountAngles> AnglesAt(Timestamp time_ns) const final;
  MountStatus status() const final;

 protected:
  using Clock = std::chrono::steady_clock;

  /// `status`: until the first Report().
  ThreadedMount(const MountOptions& mount, const ThreadedMountOptions& options,
                const MountStatus& status);

  /// Begins to talk: the last step of a driver's Create().
  void Start();
  /// Ends it, and waits: the first step of a driver's destructor, as Session() uses its members.
  void End();

  // The rest is for Session(), on the mount's own thread.

  /// One connection: opens the device and goes on until it is lost (why, in words with the remedy)
  /// or `stop` is requested (OK).
  virtual absl::Status Session(const std::stop_token& stop) = 0;

  /// What is demanded now, `ahead_s` later; nothing: stay. Rates count for kDemandHeld_s at most.
  struct Goal {
    Eigen::Vector3d angles_rad, rate_limits_rad_s;
  };
  std::optional<Goal> Demanded(double ahead_s) const;
  /// Once after each Stop() that ended a demand.
  bool TakeBrake();
  /// A reading of all joints, there at `time_ns` by the driver's clock; the model's encoder_delay_s
  /// is taken off here. The first of a session says that the connection works.
  void AddReading(Timestamp time_ns, const Eigen::Vector3d& angles_rad);
  bool has_reading() const { return has_reading_; }  // in this session
  /// The newest of this session, whatever its age.
  std::optional<EncoderReading> LastReading() const;
  /// `problem` in words; empty: ready.
  void Report(const std::string& problem);
  /// False: stop was requested.
  bool WaitUntil(Clock::time_point time, const std::stop_token& stop);

 private:
  void Run(const std::stop_token& stop);
  void Lose(const std::string& problem);

  const MountModel model_;
  const double retry_s_, max_retry_s_, silent_s_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  // Under mutex_.
  std::optional<MountDemand> demand_;  // absent: stays where it is
  Timestamp demanded_ns_ = 0;
  bool brake_ = false;
  EncoderRing encoders_;
  Timestamp read_ns_ = 0;  // when the newest reading came
  MountHealth health_;
  std::string problem_;
  bool has_reading_ = false;  // own thread
  std::jthread thread_;
};

}  // namespace saccade
