#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "server/mount/drivers/v4l2_controls.hpp"
#include "server/mount/mount_options.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A camera that turns itself (UVC: pan, tilt, zoom). It has no encoders that can be relied on:
/// where it is, is reckoned from what it was told, unless `read_back`.
struct V4l2Options {
  std::string device;      // from the URI, e.g. /dev/video0
  double update_hz = 20;   // commands per second: each is a USB control transfer
  bool read_back = false;  // believe what the camera says of its position
  /// What one unit of the relative controls turns, for cameras without absolute ones: V4L2 leaves
  /// it open. Logitech's is a 64th of a degree.
  double relative_unit_deg = 1.0 / 64.0;
  double reckoned_sigma_deg = 1.0;          // of a reckoned angle
  double zoom = -1;                         // 0 to 1 of the range, set once; -1: left alone
  double retry_s = 0.2, max_retry_s = 2.0;  // between attempts to reconnect

  absl::Status Validate() const;
  /// Reads the [v4l2] table; a file without one changes nothing.
  absl::Status LoadToml(const std::filesystem::path& file);
  /// That table with all defaults, each key with its range and meaning.
  static std::string Describe();
};

/// Pan, tilt and zoom of one device: angles instead of controls. Explicit time; one thread.
class V4l2Head {
 public:
  /// Finds out what the camera can, resets relative axes to zero, sets the zoom.
  ///   FailedPrecondition  it cannot turn at all: names device and remedy
  static absl::StatusOr<std::unique_ptr<V4l2Head>> Open(const V4l2Options& options,
                                                        const MountOptions& mount,
                                                        std::unique_ptr<VideoDevice> device);

  /// `mount` within what the camera can: joints that it lacks are fixed.
  const MountOptions& mount() const { return mount_; }

  /// Turns towards `angles_rad`; sends only what changes. Unavailable: the camera is gone.
  absl::Status Step(Timestamp now_ns, const Eigen::Vector3d& angles_rad);
  /// Where it is by now [rad], read or reckoned.
  const Eigen::Vector3d& angles_rad() const { return angles_rad_; }
  /// 0 to 1 of the range. FailedPrecondition: no zoom.
  absl::Status SetZoom(double share);

 private:
  struct Axis {
    bool absolute = true;
    std::uint32_t id = 0;
    V4l2Controls::Range range;
    double unit_rad = 0;
    std::optional<std::int32_t> sent;  // last value; of a relative axis the sum of all
  };
  V4l2Head(const V4l2Options& options, const MountOptions& mount,
           std::unique_ptr<VideoDevice> device)
      : options_(options), mount_(mount), controls_(options.device, std::move(device)) {}
  absl::Status FindAxis(MountJoint joint, std::uint32_t absolute, std::uint32_t relative,
                        std::uint32_t reset);
  void Narrow(JointOptions& joint, const Axis& axis) const;
  std::int32_t ValueFor(const JointOptions& joint, const Axis& axis, double angle_rad) const;
  absl::Status Observe(Timestamp now_ns);

  const V4l2Options options_;
  MountOptions mount_;
  V4l2Controls controls_;
  std::array<std::optional<Axis>, kMountJoints> axes_;
  Eigen::Vector3d angles_rad_ = Eigen::Vector3d::Zero();
  std::optional<Timestamp> last_ns_;
};

}  // namespace saccade
