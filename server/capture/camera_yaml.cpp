#include "server/capture/camera_yaml.hpp"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <span>

namespace saccade {
namespace {

struct Written {
  const char* name;
  std::size_t coefficients;
};

Written LensOf(LensModel model) {
  switch (model) {
    case LensModel::kRadial1:
      return {"radial1", 1};
    case LensModel::kBrownConrady:
      return {"brown_conrady", 5};
    case LensModel::kKannalaBrandt:
      return {"kannala_brandt", 4};
    case LensModel::kFov:
      return {"fov", 1};
    default:
      return {"pinhole", 0};
  }
}

}  // namespace

std::string CameraYaml(const CameraIntrinsics& camera, const std::string& comment) {
  const Written lens = LensOf(camera.model);
  std::string text = comment.empty() ? "" : absl::StrFormat("# %s\n", comment);
  absl::StrAppendFormat(&text,
                        "model: %s\nwidth: %d\nheight: %d\nfx: %.17g\nfy: %.17g\ncx: %.17g\n"
                        "cy: %.17g\n",
                        lens.name, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                        camera.cy);
  const auto number = [](std::string* out, double value) {
    absl::StrAppendFormat(out, "%.17g", value);
  };
  const std::span<const double> coefficients(camera.distortion.data(), lens.coefficients);
  absl::StrAppendFormat(&text, "distortion: [%s]\nfps: %.9g\n",
                        absl::StrJoin(coefficients, ", ", number), camera.fps);
  if (camera.rolling_shutter_readout_s > 0) {
    absl::StrAppendFormat(&text, "rolling_shutter_readout_s: %.9g\n",
                          camera.rolling_shutter_readout_s);
  }
  return text;
}

}  // namespace saccade
