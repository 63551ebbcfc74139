#include "server/capture/camera_file.hpp"

#include <absl/strings/str_cat.h>

#include "server/capture/yaml_reader.hpp"

namespace saccade {
namespace {

struct LensName {
  absl::string_view name;
  LensModel model;
  std::size_t coefficients;
  absl::string_view order;
};
constexpr LensName kLenses[] = {
    {"pinhole", LensModel::kPinhole, 0, "none: []"},
    {"radial1", LensModel::kRadial1, 1, "[k1] in px^-2"},
    {"brown_conrady", LensModel::kBrownConrady, 5, "[k1, k2, p1, p2, k3]"},
    {"kannala_brandt", LensModel::kKannalaBrandt, 4, "[k1, k2, k3, k4]"},
};
constexpr int kMaxSide_px = 16384;

}  // namespace

absl::StatusOr<CameraIntrinsics> LoadCamera(const std::filesystem::path& file) {
  YamlReader yaml(file);
  yaml.AllowOnly({"model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "fps",
                  "rolling_shutter_readout_s", "T_body_camera"});
  const std::string name = yaml.Text("model");
  const LensName* lens = nullptr;
  for (const LensName& each : kLenses) {
    if (each.name == name) lens = &each;
  }
  if (yaml.ok() && lens == nullptr) {
    yaml.Fail("model", absl::StrCat("lens model '", name,
                                    "' is unknown; use pinhole, radial1, brown_conrady or "
                                    "kannala_brandt"));
  }
  CameraIntrinsics camera;
  camera.width = yaml.Integer("width", 16, kMaxSide_px);
  camera.height = yaml.Integer("height", 16, kMaxSide_px);
  camera.fx = yaml.Number("fx", YamlReader::kPositive);
  camera.fy = yaml.Number("fy", YamlReader::kPositive);
  // The principal point may lie outside a cropped picture, but not by more than its size.
  camera.cx = yaml.Number("cx", {-1.0 * camera.width, 2.0 * camera.width});
  camera.cy = yaml.Number("cy", {-1.0 * camera.height, 2.0 * camera.height});
  camera.fps = yaml.Number("fps", {0.1, 10000.0}, 30.0);
  camera.rolling_shutter_readout_s = yaml.Number("rolling_shutter_readout_s", {0.0, 1.0}, 0.0);
  if (yaml.Has("T_body_camera")) yaml.Numbers("T_body_camera", 16);
  const std::vector<double> distortion = yaml.Numbers("distortion", std::nullopt, true);
  if (yaml.ok() && distortion.size() != lens->coefficients) {
    yaml.Fail("distortion", absl::StrCat("has ", distortion.size(), " coefficients, but ", name,
                                         " takes ", lens->coefficients, " (", lens->order, ")"));
  }
  if (!yaml.ok()) return yaml.status();
  camera.model = lens->model;
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  const CameraModel model(camera);
  if (!model.Unproject({camera.cx, camera.cy})) {
    yaml.Fail("distortion", "cannot be inverted even at the picture's centre; check the numbers");
    return yaml.status();
  }
  return camera;
}

}  // namespace saccade
