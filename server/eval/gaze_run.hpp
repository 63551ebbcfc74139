#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/eval/claims.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/statistics.hpp"
#include "server/gaze/gaze_loop.hpp"
#include "server/mount/drivers/sim_mount.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {

struct GazeRunOptions {
  SimOptions sim;
  SimMountOptions mount;
  GazeOptions gaze;
  TrackerArguments tracker;
  std::filesystem::path folder;
  bool encoders = true;  // false: frames carry no joint angles to the tracker; gaze still has them
  double delay_s = 0.040;  // from mid-exposure to the published pose: exposure, transfer, tracking
  double control_hz = 100.0;
};

/// The whole loop on simulated time: rendered pictures to the real tracker, its snapshots to the
/// real gaze control, its demands to the simulated head, whose angles the next picture is taken at.
/// Nothing depends on how long anything takes to compute. One thread.
class GazeRun {
 public:
  static absl::StatusOr<std::unique_ptr<GazeRun>> Create(const GazeRunOptions& options);

  /// Lets time pass; `tick` is called after every control step.
  absl::Status RunUntil(
      double time_s, const std::function<void()>& tick = [] {});

  double time_s() const { return Seconds(now_ns_); }
  Timestamp now_ns() const { return now_ns_; }
  GazeLoop& loop() { return *loop_; }
  SimMount& mount() { return *mount_; }
  SimSource& source() { return *source_; }
  const MapSnapshot* newest() const { return newest_.get(); }
  FrameId newest_frame() const { return next_frame_ - 1; }

  /// Where an expert may click: an annotation that he placed, and the surface point that he meant.
  struct Clicked {
    std::string id;
    Eigen::Vector3d true_point = Eigen::Vector3d::Zero();
  };
  /// Clicks the pixel of a named object, or without one the surface at the picture's centre, in the
  /// newest tracked frame. An error says why the click was refused.
  absl::StatusOr<Clicked> Click(const std::optional<Eigen::Vector3d>& object);

  /// How far the joint that has the longest way must turn to look at an annotation; nothing while
  /// the wearer's pose is not known.
  std::optional<double> Way_deg(const std::string& id) const;
  /// A line in looks.csv: what became of a saccade to `target`, commanded at `begin_s`.
  void WriteLook(const Clicked& target, double begin_s, std::optional<double> arrival_s);

  // Truth at the present moment.
  Rigid3 TrueCamera() const { return source_->WorldFromCameraAt(now_ns_); }
  double TrueError_deg(const Eigen::Vector3d& point_in_world) const;
  /// Of the camera's x axis against the horizon.
  double TrueRoll_deg() const;

  // Sums so far.
  const RunRecorder& recorder() const { return recorder_; }
  const Trajectory& truth() const { return truth_; }
  const ClaimLog& claims() const { return claims_; }
  const Sample& measured() const { return measured_; }  // features, of frames after the start-up
  double peak_rate_deg_s() const { return peak_rate_deg_s_; }
  double mean_searched_px2() const { return searched_px2_.size() ? searched_px2_.Mean() : 0; }
  /// Features of the newest map that claim to know their depth, but are off by more than 30 % (or
  /// not there at all).
  struct DepthClaims {
    int total = 0, false_depth = 0;
  };
  DepthClaims CheckDepths() const;
  /// clicks.csv: how far off each annotation is, when it was placed and now.
  absl::Status Close();

 private:
  GazeRun(const GazeRunOptions& options, std::unique_ptr<SimSource> source,
          std::shared_ptr<SimMount> mount, std::unique_ptr<Wearable> wearable, RunRecorder recorder,
          OutputFile truth_file, OutputFile gaze_file, OutputFile looks_file);
  absl::Status TakeFrame();
  std::optional<Annotation> Find(const std::string& id) const;
  absl::Status WriteClicks() const;
  absl::Status Record(const Frame& frame, const FrameCost& cost);
  void Control();

  const GazeRunOptions options_;
  std::shared_ptr<SimMount> mount_;
  std::unique_ptr<SimSource> source_;
  std::unique_ptr<Wearable> wearable_;
  RunRecorder recorder_;
  OutputFile truth_file_, gaze_file_, looks_file_;
  std::unique_ptr<GazeLoop> loop_;
  Timestamp now_ns_ = 0;
  FrameId next_frame_ = 0;
  std::shared_ptr<const MapSnapshot> newest_;
  /// A frame's result on its way to gaze control.
  struct Due {
    Timestamp publish_ns;
    GazeView view;
  };
  std::deque<Due> due_;
  bool ended_ = false;
  struct PlacedClick {
    double time_s;
    Clicked clicked;
    Annotation placed;
    Rigid3 world_from_camera;  // true
  };
  std::vector<PlacedClick> clicks_;
  ClaimLog claims_;
  int requests_ = 0;
  Trajectory truth_;
  Sample measured_, searched_px2_;
  std::optional<Eigen::Vector3d> last_joints_;
  double peak_rate_deg_s_ = 0;
};

}  // namespace saccade
