#include "shared/io/video_modes.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace saccade {
namespace {

constexpr int kMost = 256;  // of formats, sizes, rates: a driver that never ends is not believed

/// Text of a fixed field that need not end with a zero.
template <std::size_t N>
std::string Text(const __u8 (&field)[N]) {
  const char* begin = reinterpret_cast<const char*>(field);
  return std::string(begin, strnlen(begin, N));
}

double Rate(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0.0
                                 : static_cast<double>(interval.denominator) / interval.numerator;
}

std::vector<double> ReadRates(VideoDevice& device, const VideoMode& mode) {
  std::vector<double> rates;
  for (__u32 index = 0; index < kMost; ++index) {
    v4l2_frmivalenum ask{};
    ask.index = index;
    ask.pixel_format = mode.fourcc;
    ask.width = static_cast<__u32>(mode.width);
    ask.height = static_cast<__u32>(mode.height);
    if (device.Ioctl(VIDIOC_ENUM_FRAMEINTERVALS, &ask) != 0) break;
    if (ask.type != V4L2_FRMIVAL_TYPE_DISCRETE) {  // the shortest and the longest interval
      rates = {Rate(ask.stepwise.min), Rate(ask.stepwise.max)};
      break;
    }
    rates.push_back(Rate(ask.discrete));
  }
  std::sort(rates.rbegin(), rates.rend());
  rates.erase(std::unique(rates.begin(), rates.end()), rates.end());
  return rates;
}

void ReadSizes(VideoDevice& device, std::uint32_t fourcc, std::vector<VideoMode>& modes) {
  for (__u32 index = 0; index < kMost; ++index) {
    v4l2_frmsizeenum ask{};
    ask.index = index;
    ask.pixel_format = fourcc;
    if (device.Ioctl(VIDIOC_ENUM_FRAMESIZES, &ask) != 0) {
      if (index == 0) modes.push_back({.fourcc = fourcc, .fps = {}});
      return;
    }
    VideoMode mode{.fourcc = fourcc, .fps = {}};
    const bool discrete = ask.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    mode.width = static_cast<int>(discrete ? ask.discrete.width : ask.stepwise.min_width);
    mode.height = static_cast<int>(discrete ? ask.discrete.height : ask.stepwise.min_height);
    mode.most_width = discrete ? mode.width : static_cast<int>(ask.stepwise.max_width);
    mode.most_height = discrete ? mode.height : static_cast<int>(ask.stepwise.max_height);
    if (!discrete) {
      mode.step_width = std::max(1, static_cast<int>(ask.stepwise.step_width));
      mode.step_height = std::max(1, static_cast<int>(ask.stepwise.step_height));
    }
    mode.fps = ReadRates(device, mode);
    modes.push_back(std::move(mode));
    if (!discrete) return;
  }
}

absl::Status CheckCapabilities(const std::string& path, const v4l2_capability& can) {
  const __u32 caps =
      (can.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? can.device_caps : can.capabilities;
  const auto refuse = [&](absl::string_view why) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": ", why));
  };
  if ((caps & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0) {
    return refuse(
        "gives pictures in several planes, which are not read; use a camera with single-planar "
        "capture (USB cameras have it, others through v4l2loopback)");
  }
  if ((caps & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return refuse(
        "gives no pictures (it may be the metadata of a camera); `saccade cameras` lists those "
        "that do");
  }
  if ((caps & V4L2_CAP_STREAMING) == 0) {
    return refuse("cannot stream through mapped memory, which is needed; use another camera");
  }
  return absl::OkStatus();
}

}  // namespace

const std::vector<VideoFormat>& VideoFormats() {
  static const std::vector<VideoFormat> formats = {{"yuyv", V4L2_PIX_FMT_YUYV},
                                                   {"nv12", V4L2_PIX_FMT_NV12},
                                                   {"mjpeg", V4L2_PIX_FMT_MJPEG},
                                                   {"grey", V4L2_PIX_FMT_GREY}};
  return formats;
}

const VideoFormat* FindVideoFormat(absl::string_view name) {
  for (const VideoFormat& each : VideoFormats()) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

std::string FormatName(std::uint32_t fourcc) {
  for (const VideoFormat& each : VideoFormats()) {
    if (each.fourcc == fourcc) return std::string(each.name);
  }
  if (fourcc == V4L2_PIX_FMT_JPEG) return "mjpeg";
  std::string letters;
  for (int shift = 0; shift < 32; shift += 8) {
    const char letter = static_cast<char>(fourcc >> shift & 0x7F);
    if (letter > ' ') letters += letter;
  }
  return letters;
}

bool VideoMode::Readable() const { return FindVideoFormat(FormatName(fourcc)) != nullptr; }

bool VideoMode::Takes(int w, int h) const {
  if (width == 0) return true;  // asked by setting it
  return w >= width && h >= height && w <= most_width && h <= most_height &&
         (w - width) % step_width == 0 && (h - height) % step_height == 0;
}

absl::StatusOr<VideoDeviceFacts> ReadVideoDevice(const std::string& path, VideoDevice& device) {
  v4l2_capability can{};
  if (const int error = device.Ioctl(VIDIOC_QUERYCAP, &can); error != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat(path, ": is no V4L2 device (", std::strerror(error),
                     "); `saccade cameras` lists those that are there"));
  }
  if (absl::Status fits = CheckCapabilities(path, can); !fits.ok()) return fits;
  VideoDeviceFacts facts{path, Text(can.card), Text(can.driver), Text(can.bus_info), {}};
  for (__u32 index = 0; index < kMost; ++index) {
    v4l2_fmtdesc format{};
    format.index = index;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.Ioctl(VIDIOC_ENUM_FMT, &format) != 0) break;
    ReadSizes(device, format.pixelformat, facts.modes);
  }
  return facts;
}

std::string ModeWords(const VideoMode& mode) {
  std::string words = FormatName(mode.fourcc);
  if (mode.width > 0) absl::StrAppend(&words, " ", mode.width, "x", mode.height);
  if (mode.most_width > mode.width || mode.most_height > mode.height) {
    absl::StrAppend(&words, " to ", mode.most_width, "x", mode.most_height);
  }
  if (mode.fps.empty()) return words;
  const auto number = [](std::string* out, double fps) { absl::StrAppendFormat(out, "%.4g", fps); };
  return absl::StrCat(words, " ", absl::StrJoin(mode.fps, "/", number), " fps");
}

std::string ModeWords(const std::vector<VideoMode>& modes) {
  std::vector<std::string> words;
  for (const VideoMode& mode : modes) {
    if (mode.Readable()) words.push_back(ModeWords(mode));
  }
  return words.empty() ? "none that is read here (mjpeg, yuyv, nv12, grey)"
                       : absl::StrJoin(words, ", ");
}

std::vector<ListedVideoDevice> ListVideoDevices(const std::filesystem::path& folder,
                                                const OpenVideoDevice& open) {
  std::vector<std::pair<int, std::string>> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    absl::string_view rest = name;
    int number = 0;
    if (absl::ConsumePrefix(&rest, "video") && absl::SimpleAtoi(rest, &number)) {
      paths.emplace_back(number, entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<ListedVideoDevice> found;
  for (const auto& [number, path] : paths) {
    const auto device = open(path);
    absl::StatusOr<VideoDeviceFacts> facts =
        device.ok() ? ReadVideoDevice(path, **device)
                    : absl::StatusOr<VideoDeviceFacts>(device.status());
    if (facts.ok()) {
      found.push_back({*std::move(facts), ""});
    } else {
      found.push_back({{path, "", "", "", {}}, std::string(facts.status().message())});
    }
  }
  return found;
}

}  // namespace saccade
