// Coefficients: their order, whose they are, and how much of the picture they can be inverted in.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <numbers>

#include "server/capture/camera_files/plausibility.hpp"

namespace saccade {
namespace {

constexpr double kMostTangential = 0.05;  // p1, p2: a lens whose axis is visibly bent has 0.01
constexpr double kRareTangential = 0.01;
constexpr double kNoCoefficient = 0.01;  // a k3 below it is a p in the wrong place, or none

std::string List(std::initializer_list<double> numbers) {
  std::string text = "[";
  for (const double number : numbers) {
    absl::StrAppend(&text, text.size() > 1 ? ", " : "", number);
  }
  return text + "]";
}

/// OpenCV's order is k1 k2 p1 p2 k3; people write k1 k2 k3 p1 p2, or a fisheye's k1 k2 k3 k4.
absl::Status CheckOrder(const CameraDraft& draft, std::vector<std::string>& warnings) {
  const auto& d = draft.lens.distortion;
  const std::string reordered = List({d[0], d[1], d[3], d[4], d[2]});
  const bool large = std::abs(d[2]) > kMostTangential || std::abs(d[3]) > kMostTangential;
  if (large && std::abs(d[3]) <= kMostTangential && std::abs(d[4]) <= kMostTangential &&
      d[4] != 0.0) {
    return draft.Error("distortion", absl::StrCat("p1 = ", d[2],
                                                  " is no lens's; this looks like [k1, k2, k3, p1, "
                                                  "p2]: the order is [k1, k2, p1, p2, k3], so "
                                                  "write ",
                                                  reordered));
  }
  const std::string fisheye =
      absl::StrCat("model: kannala_brandt and distortion: ", List({d[0], d[1], d[2], d[3]}));
  if (large) {
    return draft.Error(
        "distortion",
        absl::StrCat("p1 = ", d[2], ", p2 = ", d[3], " are no lens's (below ", kMostTangential,
                     "); the order is [k1, k2, p1, p2, k3]",
                     d[4] == 0.0
                         ? absl::StrCat(". A fisheye's (equidistant) k1 k2 k3 k4 are ", fisheye)
                         : std::string()));
  }
  if (d[2] == 0.0 && d[3] != 0.0 && d[4] != 0.0 && std::abs(d[4]) < kNoCoefficient) {
    warnings.push_back(draft.Words("distortion", absl::StrCat("p1 = 0 and k3 = ", d[4],
                                                              " may be [k1, k2, k3, p1, p2]: then "
                                                              "write ",
                                                              reordered)));
  }
  if (d[4] == 0.0 && (std::abs(d[2]) > kRareTangential || std::abs(d[3]) > kRareTangential)) {
    warnings.push_back(
        draft.Words("distortion", absl::StrCat("p1 = ", d[2], ", p2 = ", d[3],
                                               " are rarely so large; if these "
                                               "are an equidistant lens's k1 k2 k3 k4, write ",
                                               fisheye)));
  }
  return absl::OkStatus();
}

/// Wide lenses bend: one that hardly does is a fisheye's coefficients under the wrong name.
void WarnOfStraightWideLens(const CameraDraft& draft, std::vector<std::string>& warnings) {
  constexpr double kWide_deg = 95.0, kStraight = 0.06;
  const CameraIntrinsics& lens = draft.lens;
  const double r = 0.5 * lens.width / lens.fx, r2 = r * r;
  const double view_deg = 360.0 / std::numbers::pi * std::atan(r);
  const auto& d = lens.distortion;
  const double bend = r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  if (view_deg < kWide_deg || std::abs(bend) > kStraight) return;
  warnings.push_back(draft.Words(
      "model", absl::StrFormat(
                   "%.0f deg wide, and bent by %.1f %% only at the edge: few lenses are. If it was "
                   "calibrated as equidistant (fisheye), write model: kannala_brandt with its "
                   "[k1, k2, k3, k4]",
                   view_deg, 100.0 * bend)));
}

/// The lens must lead back from pixel to ray in most of the picture.
absl::Status CheckMonotonic(const CameraDraft& draft, std::vector<std::string>& warnings) {
  constexpr int kSteps = 9;
  const CameraIntrinsics& lens = draft.lens;
  const CameraModel model(lens);
  if (!model.Unproject({lens.cx, lens.cy})) {
    return draft.Error("distortion",
                       "cannot be inverted even at the picture's centre; check the numbers");
  }
  int inverted = 0;
  double least_px = 1e9;  // of the places that nothing leads back from
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Eigen::Vector2d pixel((i % kSteps) * (lens.width - 1.0) / (kSteps - 1),
                                (i / kSteps) * (lens.height - 1.0) / (kSteps - 1));
    if (model.Unproject(pixel)) {
      ++inverted;
    } else {
      least_px = std::min(least_px, (pixel - Eigen::Vector2d(lens.cx, lens.cy)).norm());
    }
  }
  constexpr int kAll = kSteps * kSteps;
  if (inverted == kAll) return absl::OkStatus();
  const bool fisheye = lens.model == LensModel::kKannalaBrandt || lens.model == LensModel::kFov;
  const std::string where = absl::StrFormat(
      "can be inverted at %d of %d places in the picture only: %s %.0f px from the centre",
      inverted, kAll,
      fisheye ? "90 deg from the axis, or where the lens turns back, is less than"
              : "the lens turns back less than",
      least_px);
  // A fisheye's picture is a circle, and may be one inside the picture.
  if (inverted < (fisheye ? 0.5 : 0.75) * kAll) {
    return draft.Error("distortion",
                       absl::StrCat(where, "; check the numbers, their order and the model"));
  }
  warnings.push_back(draft.Words("distortion", absl::StrCat(where, "; nothing is seen beyond")));
  return absl::OkStatus();
}

}  // namespace

bool FovAngleIsPossible(const CameraIntrinsics& lens) {
  return lens.model != LensModel::kFov ||
         (lens.distortion[0] > 0.0 && lens.distortion[0] < std::numbers::pi);
}

absl::Status CheckDistortion(const CameraDraft& draft, std::vector<std::string>& warnings) {
  const CameraIntrinsics& lens = draft.lens;
  if (!FovAngleIsPossible(lens)) {
    const double w = lens.distortion[0];
    return draft.Error(
        "distortion",
        absl::StrCat("w = ", w,
                     " is out of range; give radians above 0 and below "
                     "pi (",
                     w / 180.0 * std::numbers::pi, " if it is in degrees), or pinhole for none"));
  }
  if (lens.model == LensModel::kBrownConrady) {
    if (absl::Status order = CheckOrder(draft, warnings); !order.ok()) return order;
  }
  if (lens.model == LensModel::kBrownConrady || lens.model == LensModel::kPinhole) {
    WarnOfStraightWideLens(draft, warnings);
  }
  return CheckMonotonic(draft, warnings);
}

}  // namespace saccade
