#include "server/mount/drivers/v4l2_controls.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>

namespace saccade {
namespace {

std::string ControlName(std::uint32_t id) {
  switch (id) {
    case V4L2_CID_PAN_ABSOLUTE:
      return "pan (absolute)";
    case V4L2_CID_TILT_ABSOLUTE:
      return "tilt (absolute)";
    case V4L2_CID_PAN_RELATIVE:
      return "pan (relative)";
    case V4L2_CID_TILT_RELATIVE:
      return "tilt (relative)";
    case V4L2_CID_PAN_RESET:
      return "pan reset";
    case V4L2_CID_TILT_RESET:
      return "tilt reset";
    case V4L2_CID_ZOOM_ABSOLUTE:
      return "zoom (absolute)";
    default:
      return absl::StrFormat("control 0x%x", id);
  }
}

}  // namespace

absl::Status V4l2Controls::Problem(int error, std::uint32_t id, const char* what) const {
  if (error == ENODEV || error == ENXIO || error == EIO || error == EBADF) {
    return absl::UnavailableError(absl::StrCat(path_, ": gone; plug the camera in again"));
  }
  const char* remedy = error == ERANGE   ? "the value is beyond its range"
                       : error == EBUSY  ? "another program uses it; close that"
                       : error == EACCES ? "it is read-only"
                       : error == EINVAL ? "the camera does not know it, or not this value"
                       : error == ENOTTY ? "this is no V4L2 device"
                                         : std::strerror(error);
  return absl::FailedPreconditionError(
      absl::StrCat(path_, ": ", ControlName(id), " cannot be ", what, ": ", remedy));
}

absl::StatusOr<std::optional<V4l2Controls::Range>> V4l2Controls::Query(std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  const int error = device_->Ioctl(VIDIOC_QUERYCTRL, &query);
  if (error == EINVAL) return std::nullopt;
  if (error != 0) return Problem(error, id, "asked for");
  if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  return Range{query.minimum, query.maximum, std::max(1, query.step)};
}

absl::Status V4l2Controls::Set(const std::vector<Value>& values) {
  if (values.empty()) return absl::OkStatus();
  std::vector<v4l2_ext_control> controls(values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    controls[k] = {};
    controls[k].id = values[k].id;
    controls[k].value = values[k].value;
  }
  v4l2_ext_controls all{};
  all.ctrl_class = V4L2_CTRL_CLASS_CAMERA;
  all.count = static_cast<__u32>(controls.size());
  all.controls = controls.data();
  const int error = device_->Ioctl(VIDIOC_S_EXT_CTRLS, &all);
  if (error == 0) return absl::OkStatus();
  // error_idx == count: none was set, and nobody says which one is to blame.
  const std::size_t blamed = all.error_idx < values.size() ? all.error_idx : 0;
  return Problem(error, values[blamed].id, "set");
}

absl::StatusOr<std::int32_t> V4l2Controls::Get(std::uint32_t id) {
  v4l2_ext_control control{};
  control.id = id;
  v4l2_ext_controls all{};
  all.ctrl_class = V4L2_CTRL_CLASS_CAMERA;
  all.count = 1;
  all.controls = &control;
  if (const int error = device_->Ioctl(VIDIOC_G_EXT_CTRLS, &all); error != 0) {
    return Problem(error, id, "read");
  }
  return std::int32_t{control.value};
}

}  // namespace saccade
