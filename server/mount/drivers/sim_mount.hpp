#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <random>

#include "server/mount/encoder_ring.hpp"
#include "server/mount/mount.hpp"
#include "server/mount/simulated_head.hpp"

namespace saccade {

struct SimMountOptions {
  MountOptions mount;  // what gaze is told of the head
  /// What the head really is; absent: what is told. Its axes, offsets, limits, noise and latency
  /// are the head's; where encoder signs, zeros and delays differ, readings and demands are off by
  /// that.
  std::optional<MountOptions> truth;
  std::uint64_t seed = 1;          // of the encoders' noise
  double encoder_hz = 100.0;       // readings per second
  double servo_gain_per_s = 25.0;  // rate per error that the servos add to the demanded rate
  /// Time is MonotonicNow(); otherwise AdvanceTo's, and runs are repeatable to the bit.
  bool wall_clock = false;
};

/// A head that is not built as everybody believes: axes 2 to 4 deg off, two encoders reversed,
/// zeros off by some degrees, readings 35 ms late, commands 60 ms. For calibrate-mount to find out.
MountOptions CrookedMount(std::uint64_t seed);

/// A simulated head: three servos with limits of angle, rate and acceleration, encoders with noise,
/// a delay between command and motion, and faults that tests put in. Moves in steps of 1 ms.
class SimMount final : public Mount, public SimulatedHead {
 public:
  explicit SimMount(const SimMountOptions& options);

  const MountModel& model() const override { return model_; }
  const MountModel& true_model() const override { return true_model_; }
  absl::Status Send(const MountDemand& demand) override;
  void Stop() override;
  std::optional<EncoderReading> Newest() const override;
  std::optional<MountAngles> AnglesAt(Timestamp time_ns) const override;
  MountStatus status() const override;

  /// Lets simulated time pass; a time before the present changes nothing. The first call sets the
  /// clock.
  void AdvanceTo(Timestamp time_ns) override;
  /// Truth, without noise; times outside the last 3 s give the nearest known.
  MountAngles TrueAngles(Timestamp time_ns) const override;
  /// What the encoders said, as a camera's driver would ask.
  std::optional<MountAngles> ReadAngles(Timestamp time_ns) const override {
    return AnglesAt(time_ns);
  }

  // Faults.
  /// No commands, no readings; the joints stay where they are. Plugged in again it holds its place.
  void SetUnplugged(bool unplugged);
  /// The joint stays where it is whatever is asked; reported after 0.3 s of not following.
  void SetStuck(MountJoint joint, bool stuck);

 private:
  struct Joint {
    double angle = 0, rate = 0;
    bool stuck = false;
    int behind_ms = 0;  // for how long it has not followed
  };
  struct Pending {
    Timestamp effect_ns;
    MountDemand demand;
    bool brake = false;
  };
  void Sync() const;  // wall clock
  void Advance(Timestamp time_ns);
  void Step();
  void StepJoint(int index, double reference, double rate);
  void ReadEncoders();

  const SimMountOptions options_;
  const MountOptions head_;
  const MountModel model_, true_model_;
  mutable std::mutex mutex_;
  std::optional<Timestamp> now_ns_;
  std::array<Joint, kMountJoints> joints_;
  std::deque<Pending> pending_;
  Pending active_{.effect_ns = 0, .demand = {}, .brake = true};
  std::deque<Eigen::Vector3d> history_;  // one per ms, the newest at now_ns_
  EncoderRing encoders_;
  Timestamp next_reading_ns_ = 0;
  bool unplugged_ = false;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
};

}  // namespace saccade
