// Kalibr's camchain.yaml: cam0, cam1, ... with camera_model, intrinsics, distortion_model.
#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

bool IsCamera(const YamlReader& yaml, const std::string& key) {
  return absl::StartsWith(key, "cam") && key.size() > 3 && absl::ascii_isdigit(key[3]) &&
         yaml.IsMap(key);
}

bool RecognisesKalibr(const CameraDocument& document) {
  for (const std::string& key : document.yaml.Keys()) {
    if (IsCamera(document.yaml, key)) return true;
  }
  return false;
}

/// The camera that was asked for, or the first.
std::string ChooseKalibrCamera(CameraDocument& document) {
  std::vector<std::string> cameras;
  for (const std::string& key : document.yaml.Keys()) {
    if (IsCamera(document.yaml, key)) cameras.push_back(key);
  }
  if (document.camera.empty()) {
    if (cameras.size() > 1) {
      Log(absl::StrCat(document.file, ": has ", absl::StrJoin(cameras, ", "), "; ", cameras[0],
                       " is taken. Another: --camera ", document.file, "#", cameras[1]));
    }
    return cameras[0];
  }
  for (const std::string& camera : cameras) {
    if (camera == document.camera) return camera;
  }
  document.yaml.Fail(document.camera, absl::StrCat("there is no such camera; the file has ",
                                                   absl::StrJoin(cameras, ", ")));
  return cameras[0];
}

/// Mei's omni camera is a pinhole camera where xi is zero; nothing else of it is exact here.
void TakeOmni(YamlReader& yaml, const std::string& prefix, CameraDraft& draft) {
  const std::vector<double> numbers = yaml.Numbers("intrinsics", 5);
  if (numbers.size() != 5) return;
  for (const char* field : {"fx", "fy", "cx", "cy"}) {
    Note(yaml, "intrinsics", prefix + "intrinsics", field, draft);
  }
  if (numbers[0] != 0.0) {
    yaml.Fail("camera_model",
              absl::StrCat("omni with xi = ", numbers[0],
                           " is not one of saccade's lenses; calibrate with `--models "
                           "pinhole-equi` (fisheye) or `pinhole-radtan`"));
    return;
  }
  draft.lens.fx = numbers[1], draft.lens.fy = numbers[2];
  draft.lens.cx = numbers[3], draft.lens.cy = numbers[4];
}

absl::Status ReadKalibr(CameraDocument& document, CameraDraft& draft) {
  draft.camera = ChooseKalibrCamera(document);
  const std::string prefix = draft.camera + ".";
  YamlReader yaml = document.yaml.Map(draft.camera);
  TakeResolution(yaml, "resolution", prefix, draft);
  const std::string model = yaml.Text("camera_model");
  if (model == "omni") {
    TakeOmni(yaml, prefix, draft);
  } else if (model == "pinhole") {
    TakeFocals(yaml, "intrinsics", prefix, draft);
  } else if (yaml.ok()) {
    yaml.Fail("camera_model", absl::StrCat("'", model,
                                           "' is not one of saccade's lenses; calibrate with "
                                           "`--models pinhole-equi` (fisheye) or "
                                           "`pinhole-radtan`"));
  }
  const std::string lens = yaml.Text("distortion_model");
  const std::vector<double> coefficients =
      yaml.Numbers("distortion_coeffs", std::nullopt, lens == "none");
  TakeLens(yaml, "distortion_model", lens, "distortion_coeffs", prefix, coefficients, draft);
  return yaml.status();
}

}  // namespace

CameraForm KalibrForm() { return {"a Kalibr camchain", RecognisesKalibr, ReadKalibr}; }

}  // namespace saccade
