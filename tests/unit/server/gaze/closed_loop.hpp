#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "server/gaze/gaze_loop.hpp"
#include "server/mount/drivers/sim_mount.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade {

constexpr Timestamp kMs = 1'000'000;

/// Gaze control on a simulated head and a wearer who moves as told; poses are exact and late, as
/// if a perfect tracker had published them, one that like the real one is coasting while the head
/// is fast. Control at 100 Hz, frames at 30 Hz.
class ClosedLoop {
 public:
  using Wearer = std::function<Rigid3(double time_s)>;

  explicit ClosedLoop(Wearer wearer, GazeOptions options = {}, SimMountOptions mount = {})
      : wearer_(std::move(wearer)),
        mount_(mount),
        loop_(mount_, options, [this] { return "lease-" + std::to_string(++ids_); }) {
    map_.status = TrackingStatus::kTracking;
    mount_.AdvanceTo(0);
  }

  SimMount& mount() { return mount_; }
  GazeLoop& loop() { return loop_; }
  const GazeSnapshot& state() const { return *loop_.snapshot(); }
  double now_s() const { return Seconds(now_ns_); }
  Timestamp now_ns() const { return now_ns_; }
  MapSnapshot& map() { return map_; }
  std::vector<Annotation>& annotations() { return annotations_; }

  Rigid3 WorldFromCamera() const {
    return wearer_(now_s()) * mount_.true_model().MountFromCamera(mount_.TrueAngles(now_ns_));
  }
  /// Between the TRUE optic axis and the point [deg].
  double TrueError_deg(const Eigen::Vector3d& point_in_world) const {
    const Eigen::Vector3d seen = WorldFromCamera().Inverse() * point_in_world;
    return std::atan2(seen.head<2>().norm(), seen.z()) / kDegree;
  }
  /// Of the camera's x axis against the horizon [deg].
  double TrueRoll_deg() const {
    const Eigen::Vector3d down = WorldFromCamera().rotation.conjugate() * Eigen::Vector3d::UnitY();
    return std::atan2(-down.x(), down.y()) / kDegree;
  }

  /// Lets time pass; `each` is called every 10 ms.
  void Run(
      double seconds, const std::function<void()>& each = [] {}) {
    const Timestamp end = now_ns_ + static_cast<Timestamp>(std::llround(1e9 * seconds));
    while (now_ns_ < end) {
      now_ns_ += 10 * kMs;
      mount_.AdvanceTo(now_ns_);
      const Eigen::Vector3d angles = ToVector(mount_.TrueAngles(now_ns_));
      if (have_last_) {
        peak_rate_deg_s_ =
            std::max(peak_rate_deg_s_, (angles - last_).cwiseAbs().maxCoeff() / 0.01 / kDegree);
      }
      last_ = angles;
      have_last_ = true;
      // The frame exposed `pose_delay` ago is published now.
      if (now_ns_ >= next_frame_ns_ + pose_delay_ns_) {
        if (tracking_) Publish(next_frame_ns_);
        next_frame_ns_ += 33'333'333;
      }
      loop_.Step(now_ns_);
      each();
    }
  }

  /// From now on the published poses are turned by this: a tracker that has lost its way.
  void SetPoseError(const Eigen::Quaterniond& error) { pose_error_ = error; }
  void SetTracking(bool tracking) { tracking_ = tracking; }
  void SetPoseDelay(Timestamp ns) { pose_delay_ns_ = ns; }
  double peak_rate_deg_s() const { return peak_rate_deg_s_; }
  void ResetPeak() { peak_rate_deg_s_ = 0; }

 private:
  void Publish(Timestamp frame_ns) {
    const std::optional<MountAngles> read = mount_.AnglesAt(frame_ns);
    map_.capture_time_ns = frame_ns;
    map_.world_from_camera = wearer_(Seconds(frame_ns)) *
                             mount_.true_model().MountFromCamera(mount_.TrueAngles(frame_ns));
    map_.world_from_camera.rotation = map_.world_from_camera.rotation * pose_error_;
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    if (read && last_read_) turned = ToVector(*read) - ToVector(*last_read_);
    constexpr double kSuspended_rad = 2.0 / 30.0;
    if (map_.status == TrackingStatus::kTracking || map_.status == TrackingStatus::kCoasting) {
      map_.status =
          turned.norm() > kSuspended_rad ? TrackingStatus::kCoasting : TrackingStatus::kTracking;
    }
    last_read_ = read;
    GazeView view;
    view.map = std::make_shared<const MapSnapshot>(map_);
    view.annotations = std::make_shared<const std::vector<Annotation>>(annotations_);
    view.angles = read;
    view.down_in_world = Eigen::Vector3d::UnitY();
    loop_.OnView(view);
  }

  const Wearer wearer_;
  int ids_ = 0;
  SimMount mount_;
  GazeLoop loop_;
  MapSnapshot map_;
  std::vector<Annotation> annotations_;
  Timestamp now_ns_ = 0, next_frame_ns_ = 0, pose_delay_ns_ = 40 * kMs;
  bool tracking_ = true, have_last_ = false;
  Eigen::Quaterniond pose_error_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d last_;
  std::optional<MountAngles> last_read_;  // of the frame before
  double peak_rate_deg_s_ = 0;
};

inline Rigid3 StandStill(double /*time_s*/) { return {}; }

/// 3 cm and 6 deg at 0.5 Hz, on all axes with different phases (T25).
inline Rigid3 Sway(double time_s) {
  const double w = std::numbers::pi * time_s;
  Rigid3 pose;
  pose.translation = 0.03 * Eigen::Vector3d(std::sin(w), std::sin(w + 2.0), std::sin(w + 4.0));
  pose.rotation = ExpQuaternion(
      6 * kDegree * Eigen::Vector3d(0.5 * std::sin(w + 1.0), std::sin(w), 0.3 * std::sin(w + 3.0)));
  return pose;
}

}  // namespace saccade
