#include "server/capture/v4l2/camera_controls.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

namespace saccade {
namespace {

constexpr double kExposureUnit_ms = 0.1;  // of V4L2_CID_EXPOSURE_ABSOLUTE

struct Control {
  const char* name;
  std::uint32_t id;
  double unit;  // one step of the device in the URI's unit
  const char* unit_name;
};
constexpr Control kExposure{"exposure", V4L2_CID_EXPOSURE_ABSOLUTE, kExposureUnit_ms, " ms"};
constexpr Control kGain{"gain", V4L2_CID_GAIN, 1, ""};
constexpr Control kFocus{"focus", V4L2_CID_FOCUS_ABSOLUTE, 1, ""};
constexpr Control kAutoFocus{"focus=auto", V4L2_CID_FOCUS_AUTO, 1, ""};

std::optional<v4l2_queryctrl> Query(VideoDevice& device, std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  if (device.Ioctl(VIDIOC_QUERYCTRL, &query) != 0) return std::nullopt;
  if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  return query;
}

int Set(VideoDevice& device, std::uint32_t id, int value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  return device.Ioctl(VIDIOC_S_CTRL, &control);
}

/// Where there is such a control; a camera that refuses keeps what it has.
void SetIfThere(VideoDevice& device, std::uint32_t id, int value) {
  if (Query(device, id)) (void)Set(device, id, value);
}

std::string ControlWords(VideoDevice& device) {
  std::vector<std::string> words;
  for (const Control& each : {kExposure, kGain, kFocus}) {
    if (const auto has = Query(device, each.id)) {
      words.push_back(absl::StrCat(each.name, " ", has->minimum * each.unit, " to ",
                                   has->maximum * each.unit, each.unit_name));
    }
  }
  if (Query(device, V4L2_CID_FOCUS_AUTO)) words.push_back("focus=auto");
  return words.empty() ? "none of exposure, gain and focus" : absl::StrJoin(words, ", ");
}

/// `value` in the URI's unit.
absl::Status SetAsked(VideoDevice& device, const std::string& path, const Control& control,
                      double value) {
  const std::optional<v4l2_queryctrl> has = Query(device, control.id);
  const auto refuse = [&](absl::string_view why) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": ", control.name, " ", value,
                                                      control.unit_name, ": ", why, "; it has ",
                                                      ControlWords(device)));
  };
  if (!has) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": this camera has no ", control.name,
                                                      "; it has ", ControlWords(device)));
  }
  const double steps = std::round(value / control.unit);
  if (steps < has->minimum || steps > has->maximum) return refuse("beyond its range");
  const int error = Set(device, control.id, static_cast<int>(steps));
  if (error == ENODEV || error == EIO) {
    return absl::UnavailableError(absl::StrCat(path, ": gone; plug the camera in again"));
  }
  return error == 0 ? absl::OkStatus() : refuse(std::strerror(error));
}

}  // namespace

absl::Status SetControls(VideoDevice& device, const V4l2Request& request) {
  const std::string& path = request.device;
  if (request.auto_focus) {
    if (absl::Status set = SetAsked(device, path, kAutoFocus, 1); !set.ok()) return set;
  } else {
    SetIfThere(device, V4L2_CID_FOCUS_AUTO, 0);
  }
  if (request.focus) {
    if (absl::Status set = SetAsked(device, path, kFocus, *request.focus); !set.ok()) return set;
  }
  if (request.exposure_ms) {
    SetIfThere(device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
    const absl::Status set = SetAsked(device, path, kExposure, *request.exposure_ms);
    if (!set.ok()) return set;
  } else {
    SetIfThere(device, V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);
  }
  if (!request.gain) return absl::OkStatus();
  SetIfThere(device, V4L2_CID_AUTOGAIN, 0);
  return SetAsked(device, path, kGain, *request.gain);
}

std::optional<Timestamp> ReadExposure(VideoDevice& device) {
  v4l2_control control{};
  control.id = V4L2_CID_EXPOSURE_ABSOLUTE;
  if (device.Ioctl(VIDIOC_G_CTRL, &control) != 0 || control.value <= 0) return std::nullopt;
  return static_cast<Timestamp>(control.value * kExposureUnit_ms * 1e6);
}

}  // namespace saccade
