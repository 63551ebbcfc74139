#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/gaze/calibration_run.hpp"
#include "server/gaze/explorer.hpp"
#include "server/gaze/gaze_arbiter.hpp"
#include "server/gaze/gaze_controller.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// What is known after one frame, as gaze needs it.
struct GazeView {
  std::shared_ptr<const MapSnapshot> map;                      // never null
  std::shared_ptr<const std::vector<Annotation>> annotations;  // may be null: none
  std::optional<MountAngles> angles;             // of the frame; absent: no reading, not used
  std::optional<Eigen::Vector3d> down_in_world;  // gravity, where it is known
};

/// Gaze control whole: commands and snapshots in, demands to the mount and a GazeSnapshot out.
/// Explicit time, no thread of its own: the server steps it by the clock, the simulation by its
/// own. One thread.
class GazeLoop {
 public:
  /// `mount` outlives the loop.
  GazeLoop(Mount& mount, const GazeOptions& options, std::function<std::string()> new_id);

  /// Answers `done` before it returns.
  void Execute(const GazeCommand& command, Timestamp now_ns);
  void OnView(const GazeView& view);
  void Step(Timestamp now_ns);
  /// Whether a participant has a stream: the wearer who has none is gone after a while.
  void SetPresence(GazeArbiter::Present present) { arbiter_.SetPresence(std::move(present)); }

  /// Without a lease, for programs that are their own pilot (evaluation).
  absl::Status Fixate(const GazeTarget& target, bool fast);
  GazeController& controller() { return controller_; }

  std::shared_ptr<const GazeSnapshot> snapshot() const { return snapshot_; }
  /// Is told each new snapshot, before the command that caused it is answered: who asks after the
  /// answer must not be told what was before.
  using Listener = std::function<void(const std::shared_ptr<const GazeSnapshot>&)>;
  void SetListener(Listener listener) { listener_ = std::move(listener); }
  /// Changes of hands since the last call.
  std::vector<Handover> TakeHandovers();

 private:
  void Steer(const SteerGaze& command, Timestamp now_ns);
  absl::Status Carry(SteerGaze::What what, Timestamp now_ns);
  std::optional<Eigen::Vector3d> PointOf(const GazeTarget& target) const;
  absl::StatusOr<Eigen::Vector3d> Resolve(const GazeTarget& target) const;
  /// Without it the head is the controller's again.
  void StopCalibrating(const char* why);
  void React(Timestamp now_ns);
  void Explore(Timestamp now_ns);
  void Publish(Timestamp now_ns);

  Mount& mount_;
  const GazeOptions options_;
  GazeController controller_;
  GazeArbiter arbiter_;
  Explorer explorer_;
  CalibrationRun calibration_;
  GazeView view_;
  std::optional<GazeTarget> target_;
  bool exploring_ = false;
  std::optional<Timestamp> looked_since_ns_;
  std::vector<Handover> handovers_;
  Listener listener_;
  std::shared_ptr<const GazeSnapshot> snapshot_ = std::make_shared<GazeSnapshot>();
};

}  // namespace saccade
