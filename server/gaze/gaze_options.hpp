#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

namespace saccade {

/// Everything that can be set about gaze; SI units and radians in the code, degrees in the file.
struct GazeOptions {
  // Motion. D03 moves its head at 30 deg/s: slow enough for the tracker to follow.
  double rate_deg_s = 30.0;            // per axis
  double acceleration_deg_s2 = 300.0;  // 0.1 s to full rate
  double gain_per_s = 12.0;            // closes the last degrees; higher: quicker, noisier
  double fast_gain_per_s = 25.0;       // fast saccades: rate and acceleration are the mount's
  double park_rate_deg_s = 15.0;       // home, when the pilot vanished

  // Prediction.
  bool compensate_latency = true;
  /// From a command to the motion it causes, beyond the mount's own command_latency.
  double servo_lag_s = 0.0;
  double pose_window_s = 0.25;        // over which the wearer's motion is fitted
  double pose_stale_s = 0.5;          // without a believed pose: the head rests
  double insist_s = 2.0;              // a pose that cannot be is believed if it stays for so long
  double suspend_above_deg_s = 90.0;  // rate of the head above which poses are not used

  // Judgement.
  double arrived_deg = 1.0;  // error below this ...
  double arrived_s = 0.2;    // ... for this long is arrival
  double not_following_deg = 3.0;
  double not_following_s = 0.3;
  double min_target_distance_m = 0.05;
  double max_target_distance_m = 30.0;  // from the wearer; further is outside any room

  // Lease.
  double heartbeat_s = 0.5;    // silence after which a pilot is gone
  double queue_silence_s = 5;  // ... and one who waits
  /// ... and a wearer whose stream is closed: a page that is loaded again needs less.
  double wearer_silence_s = 10;
  double turn_grace_s = 3.0;  // for the next in the queue to notice that it is his turn

  // Idle time.
  bool explore_when_idle = false;
  double explore_dwell_s = 2.0;

  /// InvalidArgument names the field, its value and its range.
  absl::Status Validate() const;
  /// Reads the [gaze] table of a TOML file over the present values; a file without one changes
  /// nothing. NotFound, InvalidArgument: name file and key.
  absl::Status LoadToml(const std::filesystem::path& file);
  /// That table with all defaults, each key with its range and meaning.
  static std::string Describe();
};

}  // namespace saccade
