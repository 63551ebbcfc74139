// camera.yaml, saccade's own (architecture, section 4).
#include <absl/strings/str_cat.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"
#include "server/capture/image_file.hpp"

namespace saccade {
namespace {

constexpr double kMaxCoefficient = 1e6;  // a slip of the pen; lenses have less than 100

bool RecognisesNative(const CameraDocument&) { return true; }

void TakeDistortion(YamlReader& yaml, CameraDraft& draft) {
  const std::string name = yaml.Text("model");
  const LensName* lens = FindLens(name);
  if (yaml.ok() && lens == nullptr) {
    yaml.Fail("model", absl::StrCat("lens model '", name,
                                    "' is unknown; use pinhole, radial1, brown_conrady, "
                                    "kannala_brandt or fov"));
  }
  const std::vector<double> distortion =
      yaml.Numbers("distortion", std::nullopt, true, {-kMaxCoefficient, kMaxCoefficient});
  if (yaml.ok() && distortion.size() != lens->coefficients) {
    yaml.Fail("distortion", absl::StrCat("has ", distortion.size(), " coefficients, but ", name,
                                         " takes ", lens->coefficients, " (", lens->order, ")"));
  }
  if (!yaml.ok()) return;
  draft.lens.model = lens->model;
  draft.told_lens = true;
  std::copy(distortion.begin(), distortion.end(), draft.lens.distortion.begin());
}

absl::Status ReadNative(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  yaml.AllowOnly({"model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "fps",
                  "rolling_shutter_readout_s", "T_body_camera"});
  for (const std::string& key : yaml.Keys()) Note(yaml, key, key, key, draft);
  CameraIntrinsics& camera = draft.lens;
  camera.width = yaml.Integer("width", 16, kMaxPictureSide_px);
  camera.height = yaml.Integer("height", 16, kMaxPictureSide_px);
  camera.fx = yaml.Number("fx", {0.0, 1e6, true});
  camera.fy = yaml.Number("fy", {0.0, 1e6, true});
  // The principal point may lie outside a cropped picture, but not by more than its size.
  camera.cx = yaml.Number("cx", {-1.0 * camera.width, 2.0 * camera.width});
  camera.cy = yaml.Number("cy", {-1.0 * camera.height, 2.0 * camera.height});
  camera.fps = yaml.Number("fps", {0.1, 1000.0}, 30.0);
  camera.rolling_shutter_readout_s = yaml.Number("rolling_shutter_readout_s", {0.0, 1.0}, 0.0);
  if (yaml.Has("T_body_camera")) yaml.Numbers("T_body_camera", 16, false, {-1e3, 1e3});
  TakeDistortion(yaml, draft);
  return yaml.status();
}

}  // namespace

CameraForm NativeForm() { return {"camera.yaml", RecognisesNative, ReadNative}; }

}  // namespace saccade
