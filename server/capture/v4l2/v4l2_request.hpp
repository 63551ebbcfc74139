#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <string>

#include "server/capture/turned_picture.hpp"
#include "shared/io/video_modes.hpp"

namespace saccade {

/// What `v4l2:DEVICE[?...]` asks for. Absent: the camera's own, or what suits the tracker.
struct V4l2Request {
  std::string device;                   // "/dev/video0"
  std::optional<int> width, height;     // size=WxH, as the camera delivers, before any turn
  std::optional<double> fps;            // fps=N
  const VideoFormat* format = nullptr;  // format=mjpeg|yuyv|nv12|grey
  std::optional<double> exposure_ms;    // exposure=MS; absent: automatic
  std::optional<int> gain;              // gain=N, in the camera's own unit
  std::optional<int> focus;             // focus=N, likewise; absent: fixed where it is
  bool auto_focus = false;              // focus=auto
  Turn turn;                            // rotate=0|90|180|270, mirror=1

  /// From what follows "v4l2:". InvalidArgument names the key and what it may be.
  static absl::StatusOr<V4l2Request> Parse(absl::string_view rest);
};

/// The mode that fits best what was asked for: of the sizes that nobody chose the one next to
/// 640x480 (a larger picture costs time and tells the tracker little), at 30 frames a second or
/// next to it, uncompressed if there is the choice.
///   InvalidArgument  the device has none: lists what it has
absl::StatusOr<VideoMode> ChooseMode(const VideoDeviceFacts& device, const V4l2Request& request);

}  // namespace saccade
