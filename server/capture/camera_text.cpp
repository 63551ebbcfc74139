#include "server/capture/camera_text.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <array>
#include <span>

#include "server/capture/camera_yaml.hpp"

namespace saccade {
namespace {

struct Form {
  CameraTextForm form;
  absl::string_view name, file_name;
};
constexpr std::array kForms = {Form{CameraTextForm::kSaccade, "saccade", "camera.yaml"},
                               Form{CameraTextForm::kKalibr, "kalibr", "camchain.yaml"},
                               Form{CameraTextForm::kRos, "ros", "camera_info.yaml"},
                               Form{CameraTextForm::kOpenCv, "opencv", "opencv_camera.yaml"}};

std::string Listed(const CameraIntrinsics& camera, std::size_t coefficients) {
  return absl::StrJoin(
      std::span<const double>(camera.distortion.data(), coefficients), ", ",
      [](std::string* out, double value) { absl::StrAppendFormat(out, "%.17g", value); });
}

std::string CommentLines(const std::string& comment) {
  return comment.empty() ? "" : absl::StrCat("# ", comment, "\n");
}

absl::Status NoWords(absl::string_view form, absl::string_view what, absl::string_view remedy) {
  return absl::FailedPreconditionError(
      absl::StrCat("form ", form, ": has no words for ", what, "; ", remedy));
}

absl::Status CheckShutter(absl::string_view form, const CameraIntrinsics& camera) {
  if (camera.rolling_shutter_readout_s <= 0) return absl::OkStatus();
  return NoWords(form, "the read-out time of a rolling shutter",
                 "write the form saccade, or set rolling_shutter_readout_s to 0");
}

absl::StatusOr<std::string> Kalibr(const CameraIntrinsics& camera, const std::string& comment) {
  std::string lens, coefficients;
  switch (camera.model) {
    case LensModel::kPinhole:
      lens = "none";
      break;
    case LensModel::kBrownConrady:
      if (camera.distortion[4] != 0.0) {
        return NoWords("kalibr", "k3, and its radtan lens ends with p2",
                       "calibrate with --form kalibr, which leaves k3 out of the fit, or write the "
                       "form ros, opencv or saccade");
      }
      lens = "radtan", coefficients = Listed(camera, 4);
      break;
    case LensModel::kKannalaBrandt:
      lens = "equidistant", coefficients = Listed(camera, 4);
      break;
    case LensModel::kFov:
      lens = "fov", coefficients = Listed(camera, 1);
      break;
    default:
      return NoWords("kalibr", "the lens radial1",
                     "calibrate with --lens brown_conrady, or write the form saccade");
  }
  return absl::StrFormat(
      "%scam0:\n  camera_model: pinhole\n  intrinsics: [%.17g, %.17g, %.17g, %.17g]\n"
      "  distortion_model: %s\n  distortion_coeffs: [%s]\n  resolution: [%d, %d]\n"
      "  cam_overlaps: []\n  rostopic: /cam0/image_raw\n",
      CommentLines(comment), camera.fx, camera.fy, camera.cx, camera.cy, lens, coefficients,
      camera.width, camera.height);
}

/// Of ROS and OpenCV, which know the same lenses.
absl::Status CheckLens(absl::string_view form, const CameraIntrinsics& camera) {
  if (camera.model == LensModel::kRadial1 || camera.model == LensModel::kFov) {
    return NoWords(form, camera.model == LensModel::kFov ? "the lens fov" : "the lens radial1",
                   camera.model == LensModel::kFov
                       ? "calibrate with --lens kannala_brandt, or write the form kalibr or saccade"
                       : "calibrate with --lens brown_conrady, or write the form saccade");
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> Ros(const CameraIntrinsics& camera, const std::string& comment) {
  if (absl::Status lens = CheckLens("ros", camera); !lens.ok()) return lens;
  const bool fisheye = camera.model == LensModel::kKannalaBrandt;
  const int coefficients = fisheye ? 4 : 5;  // a pinhole's are zero
  std::string text = CommentLines(comment);
  absl::StrAppendFormat(&text,
                        "image_width: %d\nimage_height: %d\ncamera_name: camera\ncamera_matrix:\n"
                        "  rows: 3\n  cols: 3\n  data: [%.17g, 0, %.17g, 0, %.17g, %.17g, 0, 0, "
                        "1]\ndistortion_model: %s\n",
                        camera.width, camera.height, camera.fx, camera.cx, camera.fy, camera.cy,
                        fisheye ? "equidistant" : "plumb_bob");
  absl::StrAppendFormat(&text, "distortion_coefficients:\n  rows: 1\n  cols: %d\n  data: [%s]\n",
                        coefficients, Listed(camera, coefficients));
  absl::StrAppendFormat(&text,
                        "rectification_matrix:\n  rows: 3\n  cols: 3\n"
                        "  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n  rows: 3\n"
                        "  cols: 4\n  data: [%.17g, 0, %.17g, 0, 0, %.17g, %.17g, 0, 0, 0, 1, 0]\n",
                        camera.fx, camera.cx, camera.fy, camera.cy);
  return text;
}

absl::StatusOr<std::string> OpenCv(const CameraIntrinsics& camera, const std::string& comment) {
  if (absl::Status lens = CheckLens("opencv", camera); !lens.ok()) return lens;
  const bool fisheye = camera.model == LensModel::kKannalaBrandt;
  const int coefficients = fisheye ? 4 : 5;
  return absl::StrFormat(
      "%%YAML:1.0\n---\n%simage_width: %d\nimage_height: %d\n%s"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ %.17g, 0., %.17g, 0., %.17g, %.17g, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: %d\n   cols: 1\n   dt: d\n"
      "   data: [ %s ]\n",
      CommentLines(comment), camera.width, camera.height, fisheye ? "fisheye_model: 1\n" : "",
      camera.fx, camera.cx, camera.fy, camera.cy, coefficients, Listed(camera, coefficients));
}

}  // namespace

absl::StatusOr<CameraTextForm> ParseCameraTextForm(absl::string_view name) {
  for (const Form& form : kForms) {
    if (form.name == name) return form.form;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("form: '", name, "' is none; give saccade, kalibr, ros or opencv"));
}

absl::string_view FileNameOf(CameraTextForm form) {
  return kForms[static_cast<std::size_t>(form)].file_name;
}

absl::StatusOr<std::string> CameraText(CameraTextForm form, const CameraIntrinsics& camera,
                                       const std::string& comment) {
  if (form == CameraTextForm::kSaccade) return CameraYaml(camera, comment);
  const absl::string_view name = kForms[static_cast<std::size_t>(form)].name;
  if (absl::Status shutter = CheckShutter(name, camera); !shutter.ok()) return shutter;
  if (form == CameraTextForm::kKalibr) return Kalibr(camera, comment);
  return form == CameraTextForm::kRos ? Ros(camera, comment) : OpenCv(camera, comment);
}

}  // namespace saccade
