// EuRoC's sensor.yaml, also of TUM-VI: intrinsics and resolution as lists, beside sensor_type.
#include <absl/strings/str_cat.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"

namespace saccade {
namespace {

bool RecognisesEuroc(const CameraDocument& document) {
  const YamlReader& yaml = document.yaml;
  return yaml.IsList("intrinsics") && (yaml.Has("sensor_type") || yaml.Has("camera_model"));
}

absl::Status ReadEuroc(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  TakeResolution(yaml, "resolution", "", draft);
  const std::string model = yaml.Text("camera_model");
  if (yaml.ok() && model != "pinhole") {
    yaml.Fail("camera_model", absl::StrCat("'", model,
                                           "' is not one of saccade's lenses; calibrate as "
                                           "pinhole with radial-tangential or equidistant"));
  }
  TakeFocals(yaml, "intrinsics", "", draft);
  if (yaml.Has("rate_hz")) draft.lens.fps = TakeNumber(yaml, "rate_hz", "", "fps", draft);
  const std::string lens = yaml.Text("distortion_model");
  const std::string listed = FirstOf(yaml, {"distortion_coefficients", "distortion_coeffs"});
  const std::vector<double> coefficients = yaml.Numbers(listed, std::nullopt, lens == "none");
  TakeLens(yaml, "distortion_model", lens, listed, "", coefficients, draft);
  return yaml.status();
}

}  // namespace

CameraForm EurocForm() { return {"an EuRoC sensor.yaml", RecognisesEuroc, ReadEuroc}; }

}  // namespace saccade
