#include "server/capture/camera_files/camera_draft.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <iterator>

namespace saccade {
namespace {

constexpr LensName kLenses[] = {
    {"pinhole", LensModel::kPinhole, 0, "none: []"},
    {"radial1", LensModel::kRadial1, 1, "[k1] in px^-2"},
    {"brown_conrady", LensModel::kBrownConrady, 5, "[k1, k2, p1, p2, k3]"},
    {"kannala_brandt", LensModel::kKannalaBrandt, 4, "[k1, k2, k3, k4]"},
    {"fov", LensModel::kFov, 1, "[w] in rad"},
};

std::string Known(double number, bool known) {
  return known ? absl::StrFormat("%.10g", number) : "?";
}

}  // namespace

const LensName* FindLens(absl::string_view name) {
  const auto* found = std::find_if(std::begin(kLenses), std::end(kLenses),
                                   [name](const LensName& each) { return each.name == name; });
  return found == std::end(kLenses) ? nullptr : found;
}

const LensName& LensOf(LensModel model) {
  return *std::find_if(std::begin(kLenses), std::end(kLenses),
                       [model](const LensName& each) { return each.model == model; });
}

std::string CameraDraft::Words(absl::string_view field, absl::string_view problem) const {
  const auto place = places.find(field);
  if (place == places.end()) return absl::StrCat(file, ": ", field, ": ", problem);
  const std::string line = place->second.line > 0 ? absl::StrCat(":", place->second.line) : "";
  return absl::StrCat(file, line, ": ", place->second.field, ": ", problem);
}

absl::Status CameraDraft::Error(absl::string_view field, absl::string_view problem) const {
  return absl::InvalidArgumentError(Words(field, problem));
}

std::string CameraLine(const CameraDraft& draft) {
  const CameraIntrinsics& lens = draft.lens;
  const bool focal = lens.fx != 0.0;
  const LensName& name = LensOf(lens.model);
  std::string text = absl::StrCat("{model: ", draft.told_lens ? name.name : "?",
                                  ", width: ", Known(lens.width, lens.width != 0),
                                  ", height: ", Known(lens.height, lens.height != 0));
  absl::StrAppend(&text, ", fx: ", Known(lens.fx, focal), ", fy: ", Known(lens.fy, focal),
                  ", cx: ", Known(lens.cx, focal), ", cy: ", Known(lens.cy, focal),
                  ", distortion: ");
  if (!draft.told_lens) {
    absl::StrAppend(&text, "?");
  } else {
    absl::StrAppend(&text, "[");
    for (std::size_t i = 0; i < name.coefficients; ++i) {
      absl::StrAppend(&text, i > 0 ? ", " : "", Known(lens.distortion[i], true));
    }
    absl::StrAppend(&text, "]");
  }
  absl::StrAppend(&text, ", fps: ", Known(lens.fps, true));
  if (lens.rolling_shutter_readout_s > 0.0) {
    absl::StrAppend(&text,
                    ", rolling_shutter_readout_s: ", Known(lens.rolling_shutter_readout_s, true));
  }
  return text + "}";
}

std::string CameraLine(const CameraIntrinsics& lens) {
  CameraDraft draft;
  draft.lens = lens;
  draft.told_lens = true;
  return CameraLine(draft);
}

}  // namespace saccade
