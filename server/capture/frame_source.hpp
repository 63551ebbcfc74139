#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/capture/imu_feed.hpp"
#include "server/capture/target.hpp"
#include "server/mount/mount_model.hpp"

namespace saccade {

/// Facts about a source that are known before its first frame.
struct SourceInfo {
  std::string uri;
  /// What people should know of it, in a few words, e.g. of a lens that is assumed; mostly empty.
  std::string remark;
  std::shared_ptr<const CameraModel> camera;
  std::optional<Target> target;    // known points, if the place has them
  std::optional<StartPose> start;  // nominal first pose
  std::optional<std::uint64_t> frame_count;
  std::shared_ptr<const MountModel> mount;  // what turns the camera; null: fixed to the wearer
  bool lens_assumed = false;                // nobody measured it: it is learnt while it is tracked
  std::shared_ptr<ImuFeed> imu;             // a unit that is fixed to the camera; null: none
};

/// Where frames come from. One thread calls Next(); the source paces itself only if it is live or
/// was opened with `realtime`.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const SourceInfo& info() const = 0;
  /// The next frame, or nothing at the end.
  /// A frame that cannot be decoded is skipped, counted in bad_frames() and named on stderr; an
  /// error means that the source as a whole is gone. Waits while the process has no file descriptor
  /// left.
  virtual absl::StatusOr<std::optional<Frame>> Next() = 0;
  virtual std::uint64_t bad_frames() const = 0;
  /// Frames of a live source that came, or should have come, and that nobody will see.
  virtual std::uint64_t dropped_frames() const { return 0; }
  /// Makes a Next() that waits for its time return nothing at once, and every later one. Any
  /// thread.
  virtual void Stop() {}
};

}  // namespace saccade
