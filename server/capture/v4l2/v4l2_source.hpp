#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <memory>

#include "server/capture/source.hpp"
#include "shared/io/video_device.hpp"

namespace saccade {

/// What has happened to a camera's pictures.
struct CameraCounts {
  std::uint64_t dropped = 0;     // left out by the driver: gaps of its sequence
  std::uint64_t torn = 0;        // incomplete or damaged
  std::uint64_t late = 0;        // with the reader more than three frames (100 ms) after exposure
  std::uint64_t superseded = 0;  // a newer one was there before the reader asked
  std::uint64_t unplugged = 0;   // times that the device went away
};

/// A live camera.
class CameraSource : public FrameSource {
 public:
  virtual CameraCounts counts() const = 0;
};

/// Opens `v4l2:DEVICE[?...]` (V4l2Request). A thread of the source empties the driver's queue and
/// keeps the newest picture alone, so that a slow reader costs frames and no latency; ids show the
/// gaps. A camera that is unplugged, or gives nothing for two seconds, is looked for until it is
/// back; Next() waits meanwhile, and can be stopped.
///
/// Without a camera file a lens of 60 degrees is assumed, and info().remark says so. `open` is for
/// tests.
///   NotFound, PermissionDenied, Unavailable  no such device, or not for this user
///   InvalidArgument     an option that is wrong or that the device cannot; a range of frames, or
///                       every frame (`realtime` false), which a live camera does not have
///   FailedPrecondition  busy, no camera, a control it lacks
absl::StatusOr<std::unique_ptr<CameraSource>> OpenV4l2(
    absl::string_view rest, const SourceOptions& options,
    OpenCaptureDevice open = OpenRealCaptureDevice);

}  // namespace saccade
