#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "shared/io/video_device.hpp"

namespace saccade {

/// A pixel format that is read, by its name in a URI and by V4L2's code.
struct VideoFormat {
  absl::string_view name;  // mjpeg, yuyv, nv12, grey
  std::uint32_t fourcc;
};
const std::vector<VideoFormat>& VideoFormats();
/// Null: not one that is read.
const VideoFormat* FindVideoFormat(absl::string_view name);
/// "mjpeg" where it is read, else the four letters that V4L2 has for it ("H264").
std::string FormatName(std::uint32_t fourcc);

/// One size of one format. Some drivers take any size of a range instead: then `most_*` is above.
struct VideoMode {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;  // px; 0: the driver does not say
  int most_width = 0, most_height = 0, step_width = 1, step_height = 1;
  std::vector<double> fps;  // falling; empty: the driver does not say

  bool Readable() const;
  bool Takes(int w, int h) const;
};

/// What a video device is.
struct VideoDeviceFacts {
  std::string path, name, driver, bus;
  std::vector<VideoMode> modes;
};

/// Asks an opened device.
///   FailedPrecondition  not a V4L2 device, or none that gives pictures this way; says what to do
absl::StatusOr<VideoDeviceFacts> ReadVideoDevice(const std::string& path, VideoDevice& device);

/// "mjpeg 1280x720 30 15 fps, yuyv 640x480 30 fps"; formats that are not read are left out.
std::string ModeWords(const std::vector<VideoMode>& modes);
std::string ModeWords(const VideoMode& mode);

/// Every device node /dev/videoN that gives pictures, and those that may not be opened (`problem`).
struct ListedVideoDevice {
  VideoDeviceFacts facts;
  std::string problem;  // why nothing more is known; empty: all is known
};
std::vector<ListedVideoDevice> ListVideoDevices(const std::filesystem::path& folder = "/dev",
                                                const OpenVideoDevice& open = OpenRealVideoDevice);

}  // namespace saccade
