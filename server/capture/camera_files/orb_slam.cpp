// Settings of ORB-SLAM2 (Camera.fx) and ORB-SLAM3 (Camera1.fx, File.version).
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"

namespace saccade {
namespace {

bool RecognisesOrbSlam(const CameraDocument& document) {
  const YamlReader& yaml = document.yaml;
  return yaml.Has("Camera.fx") || yaml.Has("Camera1.fx") ||
         (yaml.Has("Camera.type") && yaml.Has("File.version"));
}

/// "Camera", "Camera1" or what was asked for: "Camera2", the right one.
std::string ChooseOrbSlamCamera(const CameraDocument& document) {
  if (!document.camera.empty()) return document.camera;
  return document.yaml.Has("Camera1.fx") ? "Camera1" : "Camera";
}

void TakeCoefficients(YamlReader& yaml, const std::string& camera, CameraDraft& draft) {
  const std::string type =
      yaml.Has("Camera.type") ? yaml.Text("Camera.type") : std::string("PinHole");
  const auto number = [&](const char* name) {
    const std::string key = absl::StrCat(camera, ".", name);
    return yaml.Has(key) ? yaml.Number(key, {}) : 0.0;
  };
  const auto needed = [&](const char* name) {
    return yaml.Number(absl::StrCat(camera, ".", name), {});
  };
  Note(yaml, "Camera.type", "Camera.type", "model", draft);
  const std::string k1 = camera + ".k1";
  if (type == "KannalaBrandt8") {
    const std::vector<double> k = {needed("k1"), needed("k2"), needed("k3"), needed("k4")};
    TakeLens(yaml, k1, "equidistant", k1, "", k, draft);
  } else if (type == "Rectified") {
    TakeLens(yaml, "Camera.type", "none", k1, "", {}, draft);
  } else if (absl::EqualsIgnoreCase(type, "PinHole")) {
    const std::vector<double> k = {number("k1"), number("k2"), number("p1"), number("p2"),
                                   number("k3")};
    const bool any = yaml.Has(k1) || yaml.Has(camera + ".p1");
    TakeOpenCvLens(yaml, k1, "", any ? k : std::vector<double>(), draft);
  } else if (yaml.ok()) {
    yaml.Fail("Camera.type", absl::StrCat("'", type,
                                          "' is unknown; write PinHole, KannalaBrandt8 "
                                          "or Rectified"));
  }
}

absl::Status ReadOrbSlam(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  const std::string camera = ChooseOrbSlamCamera(document), prefix = camera + ".";
  draft.camera = document.camera;
  if (!document.camera.empty() && !yaml.Has(prefix + "fx")) {
    yaml.Fail(prefix + "fx", "there is no such camera; use Camera, Camera1 or Camera2");
  }
  if (yaml.Has("Camera.width") || yaml.Has("Camera.height")) {
    draft.lens.width = static_cast<int>(TakeNumber(yaml, "Camera.width", "", "width", draft));
    draft.lens.height = static_cast<int>(TakeNumber(yaml, "Camera.height", "", "height", draft));
  }
  draft.lens.fx = TakeNumber(yaml, prefix + "fx", "", "fx", draft);
  draft.lens.fy = TakeNumber(yaml, prefix + "fy", "", "fy", draft);
  draft.lens.cx = TakeNumber(yaml, prefix + "cx", "", "cx", draft);
  draft.lens.cy = TakeNumber(yaml, prefix + "cy", "", "cy", draft);
  if (yaml.Has("Camera.fps")) draft.lens.fps = TakeNumber(yaml, "Camera.fps", "", "fps", draft);
  TakeCoefficients(yaml, camera, draft);
  return yaml.status();
}

}  // namespace

CameraForm OrbSlamForm() { return {"an ORB-SLAM settings file", RecognisesOrbSlam, ReadOrbSlam}; }

}  // namespace saccade
