#include "server/capture/camera_files/plausibility.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <cstdint>
#include <numbers>

#include "server/capture/image_file.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr double kLeastView_deg = 1.0;   // of a telescope
constexpr double kNarrowView_deg = 5.0;  // a long lens; a slip is likelier
constexpr double kWideView_deg = 120.0;  // without being a fisheye: hardly sold
constexpr double kMostView_deg = 160.0;  // without being a fisheye: nobody makes it
constexpr double kMostFisheye_deg = 200.0;

bool IsFisheye(LensModel model) {
  return model == LensModel::kKannalaBrandt || model == LensModel::kFov;
}

/// Full field of view along a side of `size_px` [deg], coefficients left out but for the FOV lens.
double FieldOfView(const CameraIntrinsics& lens, int size_px, double focal_px) {
  if (lens.model == LensModel::kKannalaBrandt) return size_px / focal_px / kDegree;  // not tangent
  const double half = 0.5 * size_px / focal_px;
  if (lens.model != LensModel::kFov) return 2.0 * std::atan(half) / kDegree;
  const double w = lens.distortion[0], angle = half * w;
  if (angle >= 0.5 * std::numbers::pi) return 2.0 * angle / kDegree;
  return 2.0 * std::atan(std::tan(angle) / (2.0 * std::tan(0.5 * w))) / kDegree;
}

/// What somebody may have meant by a focal length that makes too wide a view.
std::string WhatFocal(double focal, int size_px, absl::string_view side) {
  if (focal < 0.1) {
    return absl::StrFormat("; is it in metres? In pixels it is focal_m / sensor_%s_m * %d", side,
                           size_px);
  }
  if (focal < 150.0) {
    return absl::StrFormat(
        "; is it in millimetres? In pixels it is focal_mm / sensor_%s_mm * %d (24 mm on 36 mm: "
        "%.0f)",
        side, size_px, 24.0 / 36.0 * size_px);
  }
  return "";
}

/// A focal length is right only together with the picture's size: the angle of both tells.
absl::Status CheckView(const CameraDraft& draft, const char* field, const char* side, int size_px,
                       double focal_px, std::vector<std::string>& warnings) {
  const bool fisheye = IsFisheye(draft.lens.model);
  const double most_deg = fisheye ? kMostFisheye_deg : kMostView_deg;
  const double view_deg = FieldOfView(draft.lens, size_px, focal_px);
  if (!FovAngleIsPossible(draft.lens)) return absl::OkStatus();  // CheckDistortion says so
  const std::string makes = absl::StrCat(focal_px, " px makes a field of view of ", view_deg,
                                         " deg over ", size_px, " px");
  if (view_deg < kLeastView_deg || view_deg > most_deg) {
    return draft.Error(
        field,
        absl::StrCat(makes, "; it must be 1 to ", most_deg, " deg: correct it, or width and height",
                     view_deg > most_deg ? WhatFocal(focal_px, size_px, side) : ""));
  }
  if (view_deg < kNarrowView_deg || (!fisheye && view_deg > kWideView_deg)) {
    warnings.push_back(draft.Words(
        field, absl::StrCat(makes,
                            ", which few cameras have: is it in pixels, and of pictures of "
                            "this size?")));
  }
  return absl::OkStatus();
}

bool Near(double a, double b, double share) { return std::abs(a - b) <= share * std::abs(b); }

}  // namespace

CameraIntrinsics Scaled(const CameraIntrinsics& lens, cv::Size size) {
  CameraIntrinsics scaled = lens;
  const double x = static_cast<double>(size.width) / lens.width;
  const double y = static_cast<double>(size.height) / lens.height;
  scaled.width = size.width, scaled.height = size.height;
  scaled.fx *= x, scaled.fy *= y;
  scaled.cx = (lens.cx + 0.5) * x - 0.5;  // the picture's edge stays its edge
  scaled.cy = (lens.cy + 0.5) * y - 0.5;
  if (lens.model == LensModel::kRadial1) scaled.distortion[0] /= x * y;  // px^-2
  return scaled;
}

std::string SizeRemedy(const CameraIntrinsics& lens, cv::Size size) {
  const double aspect = static_cast<double>(lens.width) / lens.height;
  const double theirs = static_cast<double>(size.width) / size.height;
  if (Near(theirs, aspect, 0.02)) {
    return absl::StrCat("if the pictures were scaled, write ", CameraLine(Scaled(lens, size)));
  }
  if (Near(1.0 / theirs, aspect, 0.02)) {
    return "the pictures stand where the file's lie: turn them, or calibrate them as they are";
  }
  return "the sides have another ratio, so they were cut: calibrate with such pictures, or take "
         "what was cut off the left and the top from cx and cy, and correct width and height";
}

absl::Status CheckSizeAndView(const CameraDraft& draft, std::vector<std::string>& warnings) {
  const CameraIntrinsics& lens = draft.lens;
  for (const auto& [field, side] : {std::pair("width", lens.width), {"height", lens.height}}) {
    if (side >= 16 && side <= kMaxPictureSide_px) continue;
    return draft.Error(field, absl::StrCat(side, " is out of range; give a number from 16 up to ",
                                           kMaxPictureSide_px));
  }
  if (std::int64_t{lens.width} * lens.height > kMaxPicturePixels) {
    return draft.Error(
        "width", absl::StrCat(lens.width, " x ", lens.height, " px is more than the ",
                              kMaxPicturePixels, " pixels that are read; scale the pictures down"));
  }
  for (const auto& [field, focal] : {std::pair("fx", lens.fx), {"fy", lens.fy}}) {
    if (focal > 0.0 && focal <= 1e6) continue;
    return draft.Error(field, absl::StrCat(focal,
                                           " is out of range; give a number above 0 up to "
                                           "1e+06"));
  }
  const bool shares =
      lens.fx < 5.0 && lens.cx > 0.0 && lens.cx < 1.0 && lens.cy > 0.0 && lens.cy < 1.0;
  if (shares) {
    return draft.Error(
        "fx", absl::StrFormat("%g px, with a centre at %g, %g: these are shares of the picture's "
                              "size; multiply fx and cx by %d, fy and cy by %d",
                              lens.fx, lens.cx, lens.cy, lens.width, lens.height));
  }
  absl::Status view = CheckView(draft, "fx", "width", lens.width, lens.fx, warnings);
  view.Update(CheckView(draft, "fy", "height", lens.height, lens.fy, warnings));
  if (!view.ok()) return view;
  const double ratio = lens.fx / lens.fy;
  const std::string odd = absl::StrCat(lens.fy, " px does not go with fx, which is ", lens.fx,
                                       " px: pixels are nearly square");
  if (ratio <= 0.25 || ratio >= 4.0) return draft.Error("fy", odd);
  if (ratio < 0.8 || ratio > 1.25) {
    warnings.push_back(
        draft.Words("fy", absl::StrCat(odd, "; right only if the pictures were stretched")));
  }
  return absl::OkStatus();
}

absl::Status CheckCentre(const CameraDraft& draft, std::vector<std::string>& warnings) {
  const CameraIntrinsics& lens = draft.lens;
  const double w = 0.5 * lens.width, h = 0.5 * lens.height;
  for (const auto& [field, c, half] :
       {std::tuple("cx", lens.cx, w), std::tuple("cy", lens.cy, h)}) {
    if (c == 0.0) {
      return draft.Error(field, absl::StrCat("0 puts the optic axis on the picture's edge; write "
                                             "what the calibration says, near ",
                                             half));
    }
    if (c >= -2.0 * half && c <= 4.0 * half) continue;
    return draft.Error(field, absl::StrCat(c, " is out of range; give a number from ", -2.0 * half,
                                           " up to ", 4.0 * half));
  }
  if (!Near(w, h, 0.1) && Near(lens.cx, h, 0.08) && Near(lens.cy, w, 0.08)) {
    return draft.Error("cx", absl::StrCat("cx ", lens.cx, " and cy ", lens.cy,
                                          " are each in the middle of the other side; exchange "
                                          "them"));
  }
  const double a = lens.cx / w, b = lens.cy / h;
  if (Near(a, b, 0.12) && (a < 0.62 || a > 1.6)) {
    const cv::Size size(static_cast<int>(std::lround(2.0 * lens.cx)),
                        static_cast<int>(std::lround(2.0 * lens.cy)));
    CameraIntrinsics theirs = lens;
    theirs.width = static_cast<int>(std::lround(lens.width * a));
    theirs.height = static_cast<int>(std::lround(lens.height * a));
    return draft.Error(
        "cx", absl::StrCat(lens.cx, ", ", lens.cy, " is the middle of a picture of about ",
                           size.width, " x ", size.height, " px, not of ", lens.width, " x ",
                           lens.height, ": write that size, or, if the pictures were scaled, ",
                           CameraLine(Scaled(theirs, {lens.width, lens.height}))));
  }
  for (const auto& [field, share, c] :
       {std::tuple("cx", a, lens.cx), std::tuple("cy", b, lens.cy)}) {
    if (share >= 0.5 && share <= 1.5) continue;
    warnings.push_back(draft.Words(
        field, absl::StrCat(c,
                            share < 0.0 || share > 2.0 ? " is outside the picture"
                                                       : " is far from the picture's middle",
                            "; right only if the picture was cut out of a larger one")));
  }
  return absl::OkStatus();
}

absl::Status CheckPlausible(const CameraDraft& draft, std::vector<std::string>& warnings) {
  const CameraIntrinsics& lens = draft.lens;
  if (!(lens.fps >= 0.1 && lens.fps <= 1000.0)) {
    return draft.Error("fps", absl::StrCat(lens.fps,
                                           " is out of range; give a number from 0.1 up "
                                           "to 1000"));
  }
  absl::Status status = CheckSizeAndView(draft, warnings);
  if (status.ok()) status = CheckCentre(draft, warnings);
  if (status.ok() && lens.rolling_shutter_readout_s * lens.fps > 1.5) {
    status = draft.Error(
        "rolling_shutter_readout_s",
        absl::StrCat(lens.rolling_shutter_readout_s, " s is longer than a frame at fps ", lens.fps,
                     "; give seconds from the first line to the last"));
  }
  if (status.ok()) status = CheckDistortion(draft, warnings);
  return status;
}

}  // namespace saccade
