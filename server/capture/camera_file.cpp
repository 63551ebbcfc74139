#include "server/capture/camera_file.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstdint>
#include <numbers>

#include "server/capture/image_file.hpp"
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

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMaxCoefficient = 1e6;  // a slip of the pen; lenses have less than 100

/// Full field of view along a side of `size_px` [rad], distortion left out.
double FieldOfView(LensModel model, int size_px, double focal_px) {
  if (model == LensModel::kKannalaBrandt) return size_px / focal_px;  // angle, not tangent
  return 2.0 * std::atan(0.5 * size_px / focal_px);
}

/// A focal length is right only together with the picture's size: the angle of both tells.
void CheckFieldOfView(YamlReader& yaml, const char* key, LensModel model, int size_px,
                      double focal_px) {
  if (!yaml.ok()) return;
  const bool fisheye = model == LensModel::kKannalaBrandt;
  const double most_deg = fisheye ? 220.0 : 175.0;
  const double view_deg = FieldOfView(model, size_px, focal_px) / kDegree;
  if (view_deg >= 1.0 && view_deg <= most_deg) return;
  yaml.Fail(key, absl::StrCat(focal_px, " px makes a field of view of ", view_deg, " deg over ",
                              size_px, " px; it must be 1 to ", most_deg,
                              " deg: correct it, or width and height"));
}

/// The lens must lead back from pixel to ray in most of the picture.
void CheckDistortion(YamlReader& yaml, const CameraIntrinsics& camera) {
  constexpr int kSteps = 5;
  const CameraModel model(camera);
  if (!model.Unproject({camera.cx, camera.cy})) {
    return yaml.Fail("distortion",
                     "cannot be inverted even at the picture's centre; check the numbers");
  }
  int inverted = 0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const double u = (i % kSteps + 0.5) * camera.width / kSteps;
    const double v = (i / kSteps + 0.5) * camera.height / kSteps;
    if (model.Unproject({u, v})) ++inverted;
  }
  if (2 * inverted >= kSteps * kSteps) return;
  yaml.Fail("distortion", absl::StrCat("can be inverted at ", inverted, " of ", kSteps * kSteps,
                                       " places in the picture only; check the numbers"));
}

/// Numbers that are each possible, but not together.
void CheckTogether(YamlReader& yaml, const CameraIntrinsics& camera) {
  if (!yaml.ok()) return;
  if (std::int64_t{camera.width} * camera.height > kMaxPicturePixels) {
    yaml.Fail("width",
              absl::StrCat(camera.width, " x ", camera.height, " px is more than the ",
                           kMaxPicturePixels, " pixels that are read; scale the pictures down"));
  }
  CheckFieldOfView(yaml, "fx", camera.model, camera.width, camera.fx);
  CheckFieldOfView(yaml, "fy", camera.model, camera.height, camera.fy);
  if (yaml.ok() && !(camera.fx / camera.fy > 0.25 && camera.fx / camera.fy < 4.0)) {
    yaml.Fail("fy", absl::StrCat(camera.fy, " px does not go with fx, which is ", camera.fx,
                                 " px: pixels are nearly square"));
  }
  if (yaml.ok() && camera.rolling_shutter_readout_s * camera.fps > 1.5) {
    yaml.Fail("rolling_shutter_readout_s",
              absl::StrCat(camera.rolling_shutter_readout_s, " s is longer than a frame at fps ",
                           camera.fps, "; give seconds from the first line to the last"));
  }
  if (yaml.ok()) CheckDistortion(yaml, camera);
}

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
  const std::vector<double> distortion =
      yaml.Numbers("distortion", std::nullopt, true, {-kMaxCoefficient, kMaxCoefficient});
  if (yaml.ok() && distortion.size() != lens->coefficients) {
    yaml.Fail("distortion", absl::StrCat("has ", distortion.size(), " coefficients, but ", name,
                                         " takes ", lens->coefficients, " (", lens->order, ")"));
  }
  if (!yaml.ok()) return yaml.status();
  camera.model = lens->model;
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  CheckTogether(yaml, camera);
  if (!yaml.ok()) return yaml.status();
  return camera;
}

}  // namespace saccade
