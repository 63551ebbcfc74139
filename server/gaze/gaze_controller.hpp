#pragma once

#include <absl/status/status.h>

#include <array>
#include <deque>
#include <optional>
#include <string>

#include "server/gaze/axis_profile.hpp"
#include "server/gaze/gaze_options.hpp"
#include "server/gaze/wearer_predictor.hpp"
#include "server/mount/mount.hpp"
#include "shared/scene/gaze.hpp"

namespace saccade {

/// A camera pose out of a snapshot with the joint angles of the same moment.
struct PoseObservation {
  Timestamp time_ns = 0;  // mid-exposure
  Rigid3 world_from_camera;
  MountAngles angles;
  bool sure = true;  // false: the tracker only guesses, but it is not lost
};

/// What the controller can tell about itself after a step.
struct GazeReport {
  GazeMode mode = GazeMode::kIdle;
  std::optional<Eigen::Vector3d> target_in_world;
  std::optional<double> error_rad;  // by the newest encoders and the predicted wearer
  bool arrived = false, target_lost = false, reachable = true, fast = false;
  double miss_rad = 0;
  std::optional<double> guidance_rad;  // see GazeSnapshot
  std::optional<Eigen::Quaterniond> world_from_view;
  std::string problem;
};

/// Turns "look there" into joint demands (slam-spec section 8): fixation, saccade, pursuit,
/// horizon, home, stop. Pure logic: time is an argument, nothing is drawn, sent or waited for. One
/// thread.
class GazeController {
 public:
  GazeController(const MountModel& model, const GazeOptions& options);

  // Commands.

  /// A saccade to the point, then pursuit. `fast`: at the mount's own limits. In mode kExplore the
  /// mode stays so.
  ///   InvalidArgument  not finite, or nearer or further than a target can be (names the field)
  absl::Status Fixate(const Eigen::Vector3d& point_in_world, bool fast,
                      GazeMode mode = GazeMode::kSaccade);
  /// The target's newest place; nothing: it is gone from the map, its last place is held.
  void UpdateTarget(const std::optional<Eigen::Vector3d>& point_in_world);
  void KeepHorizon();
  void Home();
  void Park();
  void Stop();
  void Idle();

  /// Direction of gravity in world; nothing: unknown, the picture is not levelled.
  void SetDown(const std::optional<Eigen::Vector3d>& down_in_world) { down_ = down_in_world; }
  /// A new pose of the tracker, as long as it is not lost. What no wearer can have done since the
  /// pose before is not believed (a tracker that has lost its way in a fast saccade), for as long
  /// as that was not long ago.
  void ObservePose(const PoseObservation& pose);
  /// Somebody else has moved the head: the next step begins where the encoders say.
  void LoseSync() { synchronised_ = false; }
  /// The map was thrown away: poses and target mean nothing now.
  void ForgetMap();

  /// One step: the demand for the mount at `now_ns`. `encoder` and `status` are the mount's newest.
  /// Steps come every 5 to 50 ms; after a gap the motion goes on from rest.
  MountDemand Step(Timestamp now_ns, const std::optional<EncoderReading>& encoder,
                   const MountStatus& status);

  const GazeReport& report() const { return report_; }
  const MountModel& model() const { return model_; }
  /// Where the mount's base is believed to be now; nothing without a pose.
  std::optional<Rigid3> WorldFromMount(Timestamp time_ns) const { return wearer_.At(time_ns); }

 private:
  struct Goal {
    Eigen::Vector3d angles, rates;
  };
  void SetMode(GazeMode mode);
  /// Where the wearer is now is not known any more.
  bool IsStale(Timestamp now_ns) const;
  bool Believable(Timestamp time_ns, const Rigid3& world_from_mount) const;
  double Horizon_s() const;
  std::optional<FixationAngles> AnglesFor(Timestamp time_ns, const MountAngles& near) const;
  std::optional<Goal> MovingGoal(Timestamp now_ns);
  std::optional<Goal> ChooseGoal(Timestamp now_ns);
  AxisLimits LimitsOf(int joint) const;
  void Resynchronise(const std::optional<EncoderReading>& encoder, const MountStatus& status);
  void Judge(Timestamp now_ns, const std::optional<EncoderReading>& encoder);
  void WatchFollowing(Timestamp now_ns, const std::optional<EncoderReading>& encoder);

  const MountModel model_;
  const GazeOptions options_;
  WearerPredictor wearer_;
  std::optional<PoseObservation> last_pose_;
  Timestamp carried_ns_ = 0;  // newest pose that was not used because the head was fast
  std::optional<Eigen::Vector3d> down_, target_;
  std::array<AxisProfile, kMountJoints> axes_;
  Eigen::Vector3d horizon_hold_ = Eigen::Vector3d::Zero();
  GazeReport report_;
  bool fast_ = false;
  bool synchronised_ = false;  // the axes agree with the encoders
  std::optional<Timestamp> last_ns_, within_since_ns_, behind_since_ns_;
  struct Sent {
    Timestamp effect_ns;
    Eigen::Vector3d angles;
  };
  std::deque<Sent> sent_;  // what the joints should have done, to compare
};

}  // namespace saccade
