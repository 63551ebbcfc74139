#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What the head is doing.
enum class GazeMode {
  kNoMount,  // the camera is fixed to the wearer
  kIdle,     // rests where it is
  kSaccade,  // on its way to a target
  kFixate,   // holds a target while the wearer moves
  kHorizon,  // holds its direction on the wearer, the picture level
  kHome,     // straight ahead, or on its way there
  kStopped,  // somebody said stop
  kExplore,  // idle time: looks where the map is most uncertain
  kParked,   // the pilot vanished: slowly home
};

/// What to look at.
struct GazeAnnotation {
  std::string id;  // UUID
};
struct GazeFeature {
  FeatureId id = 0;
};
struct GazePoint {
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();  // [m]
};
using GazeTarget = std::variant<GazeAnnotation, GazeFeature, GazePoint>;

/// Someone who pilots, or waits to.
struct GazePilot {
  std::string participant_id;  // public; not the session's credential
  std::string display_name;
};

/// What calibrate-mount is doing, or has found.
struct MountCalibrationReport {
  bool running = true;
  double share = 0;     // of the way, 0 to 1
  std::string problem;  // why there is no result, with the remedy; empty: running, or well
  std::string toml;     // the [mount_model] table for the server's file; empty until found
  struct Joint {
    std::string name;
    bool moved = false;     // false: without a motor; left as it was
    double range_rad = 0;   // that it moved
    double turned_rad = 0;  // of its axis against the one before, signs apart
    double axis_sigma_rad = 0;
    bool sign_flipped = false;
    double zero_shift_rad = 0;
  };
  std::vector<Joint> joints;
  // Residuals of the camera's orientation: by the model before, by the one found.
  double orientation_rms_before_rad = 0, orientation_rms_rad = 0, orientation_max_rad = 0;
  double position_rms_m = 0;     // 0: the map has no metres
  double encoder_delay_s = 0;    // of the encoders' time stamps against the pictures'
  double command_latency_s = 0;  // from a command to the motion
  int pictures = 0, outliers = 0;
};

/// Everything that is told about gaze; immutable once published.
struct GazeSnapshot {
  GazeMode mode = GazeMode::kNoMount;
  Timestamp time_ns = 0;
  std::optional<Eigen::Vector3d> joints_rad;  // pan, elevation, cyclotorsion, by the encoders
  std::optional<GazeTarget> target;
  std::optional<Eigen::Vector3d> target_in_world;  // where it is believed to be [m]
  std::optional<double> error_rad;  // between optic axis and target, as far as is known
  bool arrived = false;             // error was below the limit for long enough, and holds
  bool target_lost = false;         // no longer in the map: holds the last known place
  bool reachable = true;            // false: looks as near as the joints allow
  double miss_rad = 0;              // by how much the joints cannot
  bool fast = false;
  std::string problem;  // mount or tracking, in words with the remedy; empty: none

  // Who steers.
  std::optional<GazePilot> pilot;  // holds the lease
  std::vector<GazePilot> queue;    // in order
  bool paused = false;             // by the wearer: nobody moves the head
  std::uint64_t handovers = 0;     // changes of hands so far
  std::string last_handover;       // in words, e.g. "Ann released; Bob pilots"

  /// Where the wearer finds a target that the joints cannot reach: angle in the picture from
  /// straight right, clockwise [rad]; absent: it is reached, or there is none.
  std::optional<double> guidance_rad;
  /// Orientation of the optic axis when the newest demand acts; digital gaze crops by it.
  std::optional<Eigen::Quaterniond> world_from_view;
  /// The last calibrate-mount; null: none so far. Asked for on its own, not streamed.
  std::shared_ptr<const MountCalibrationReport> calibration;
};

/// "no mount", "idle", "saccade" ...
inline const char* ToString(GazeMode mode) {
  constexpr const char* kNames[] = {"no mount", "idle",    "saccade", "fixate", "horizon",
                                    "home",     "stopped", "explore", "parked"};
  return kNames[static_cast<int>(mode)];
}

}  // namespace saccade
