#include "server/capture/camera_files/fields.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <array>

namespace saccade {
namespace {

constexpr absl::string_view kBrown[] = {"radtan",    "radial-tangential", "radial_tangential",
                                        "plumb_bob", "brown_conrady",     "rational_polynomial"};
constexpr absl::string_view kFisheye[] = {"equidistant", "equi", "fisheye", "kannala_brandt"};

template <std::size_t N>
bool OneOf(const absl::string_view (&names)[N], absl::string_view name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

void SetLens(LensModel model, const std::vector<double>& coefficients, CameraDraft& draft) {
  draft.lens.model = model;
  draft.lens.distortion = {};
  std::copy_n(coefficients.begin(), std::min<std::size_t>(5, coefficients.size()),
              draft.lens.distortion.begin());
  draft.told_lens = true;
}

}  // namespace

std::string FirstOf(const YamlReader& yaml, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (yaml.Has(name)) return name;
  }
  return *names.begin();
}

void Note(const YamlReader& yaml, const std::string& key, const std::string& spelt,
          absl::string_view field, CameraDraft& draft) {
  draft.places[std::string(field)] = {spelt, yaml.Line(key)};
}

double TakeNumber(YamlReader& yaml, const std::string& key, const std::string& prefix,
                  absl::string_view field, CameraDraft& draft) {
  Note(yaml, key, prefix + key, field, draft);
  return yaml.Number(key, {});
}

void TakeResolution(YamlReader& yaml, const std::string& key, const std::string& prefix,
                    CameraDraft& draft) {
  const std::vector<double> size = yaml.Numbers(key, 2, false, {0, 1e6});
  for (const char* field : {"width", "height"}) Note(yaml, key, prefix + key, field, draft);
  if (size.size() != 2) return;
  draft.lens.width = static_cast<int>(size[0]);
  draft.lens.height = static_cast<int>(size[1]);
}

void TakeFocals(YamlReader& yaml, const std::string& key, const std::string& prefix,
                CameraDraft& draft) {
  const std::vector<double> numbers = yaml.Numbers(key, 4);
  int at = 0;
  for (const char* field : {"fx", "fy", "cx", "cy"}) {
    Note(yaml, key, absl::StrCat(prefix, key, "[", at++, "]"), field, draft);
  }
  if (numbers.size() != 4) return;
  draft.lens.fx = numbers[0], draft.lens.fy = numbers[1];
  draft.lens.cx = numbers[2], draft.lens.cy = numbers[3];
}

void TakeMatrix(YamlReader& yaml, const std::string& key, const std::string& prefix,
                const std::vector<double>& k, CameraDraft& draft) {
  constexpr std::pair<const char*, int> kFields[] = {{"fx", 0}, {"cx", 2}, {"fy", 4}, {"cy", 5}};
  for (const auto& [field, at] : kFields) {
    Note(yaml, key, absl::StrCat(prefix, key, "[", at, "]"), field, draft);
  }
  if (!yaml.ok()) return;
  if (k.size() != 9) {
    yaml.Fail(key, absl::StrCat("has ", k.size(),
                                " numbers; a camera matrix has nine: "
                                "[fx, 0, cx, 0, fy, cy, 0, 0, 1]"));
    return;
  }
  if (std::all_of(k.begin(), k.end(), [](double each) { return each == 0.0; })) {
    yaml.Fail(key,
              "is all zero: this camera was never calibrated; calibrate it, or leave the "
              "camera file out");
    return;
  }
  draft.lens.fx = k[0], draft.lens.fy = k[4], draft.lens.cx = k[2], draft.lens.cy = k[5];
  const bool standard = k[1] == 0.0 && k[3] == 0.0 && k[6] == 0.0 && k[7] == 0.0 && k[8] == 1.0;
  if (!standard) {
    yaml.Fail(key,
              "is not [fx, 0, cx, 0, fy, cy, 0, 0, 1]: a skewed camera is not one of "
              "saccade's, calibrate without skew; or is it written column by column?");
  }
}

void TakeOpenCvLens(YamlReader& yaml, const std::string& listed, const std::string& prefix,
                    const std::vector<double>& coefficients, CameraDraft& draft) {
  Note(yaml, listed, prefix + listed, "distortion", draft);
  if (!yaml.ok()) return;
  if (coefficients.empty()) return SetLens(LensModel::kPinhole, {}, draft);
  constexpr std::size_t kSizes[] = {4, 5, 8, 12, 14};
  if (std::find(std::begin(kSizes), std::end(kSizes), coefficients.size()) == std::end(kSizes)) {
    yaml.Fail(listed, absl::StrCat("has ", coefficients.size(),
                                   " coefficients; write four or five: [k1, k2, p1, p2, k3]"));
    return;
  }
  const auto beyond = coefficients.begin() + std::min<std::ptrdiff_t>(5, std::ssize(coefficients));
  if (std::any_of(beyond, coefficients.end(), [](double each) { return each != 0.0; })) {
    yaml.Fail(listed,
              absl::StrCat("[", absl::StrJoin(beyond, coefficients.end(), ", "),
                           "] after [k1, k2, p1, p2, k3] are not zero: the rational, thin-prism "
                           "and tilted lenses are not saccade's; calibrate with five coefficients "
                           "(plumb_bob; OpenCV without CALIB_RATIONAL_MODEL), or as a fisheye "
                           "(equidistant)"));
    return;
  }
  SetLens(LensModel::kBrownConrady, coefficients, draft);
}

void TakeLens(YamlReader& yaml, const std::string& named, const std::string& name,
              const std::string& listed, const std::string& prefix,
              const std::vector<double>& coefficients, CameraDraft& draft) {
  Note(yaml, named, prefix + named, "model", draft);
  Note(yaml, listed, prefix + listed, "distortion", draft);
  if (!yaml.ok()) return;
  if (name == "none" || name.empty()) {
    const bool zero = std::all_of(coefficients.begin(), coefficients.end(),
                                  [](double each) { return each == 0.0; });
    if (zero) return SetLens(LensModel::kPinhole, {}, draft);
    yaml.Fail(named, absl::StrCat("names no lens, but ", prefix, listed,
                                  " has coefficients; write radtan or equidistant"));
  } else if (OneOf(kBrown, name)) {
    TakeOpenCvLens(yaml, listed, prefix, coefficients, draft);
  } else if (OneOf(kFisheye, name) || name == "fov") {
    const std::size_t wanted = name == "fov" ? 1 : 4;
    if (coefficients.size() == wanted) {
      SetLens(wanted == 1 ? LensModel::kFov : LensModel::kKannalaBrandt, coefficients, draft);
    } else {
      yaml.Fail(listed, absl::StrCat("has ", coefficients.size(), " coefficients, but ", name,
                                     " takes ", wanted == 1 ? "[w] in rad" : "[k1, k2, k3, k4]"));
    }
  } else {
    yaml.Fail(named, absl::StrCat("lens '", name,
                                  "' is not one of saccade's; calibrate as radtan (plumb_bob), "
                                  "equidistant or fov"));
  }
}

}  // namespace saccade
