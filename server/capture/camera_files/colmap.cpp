// COLMAP's cameras.txt: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]. COLMAP's pixel (0.5, 0.5) is the
// centre of the top-left one, ours is (0, 0).
#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/capture/camera_files/forms.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

/// Where the k-th parameter goes: f is fx and fy, x and y the centre; 0 to 4 the coefficient; z one
/// that must be zero.
struct Model {
  absl::string_view name;
  LensModel lens;
  absl::string_view parameters;
};
constexpr Model kModels[] = {
    {"SIMPLE_PINHOLE", LensModel::kPinhole, "fxy"},
    {"PINHOLE", LensModel::kPinhole, "hvxy"},
    {"SIMPLE_RADIAL", LensModel::kBrownConrady, "fxy0"},
    {"RADIAL", LensModel::kBrownConrady, "fxy01"},
    {"OPENCV", LensModel::kBrownConrady, "hvxy0123"},
    {"FULL_OPENCV", LensModel::kBrownConrady, "hvxy01234zzz"},
    {"OPENCV_FISHEYE", LensModel::kKannalaBrandt, "hvxy0123"},
    {"SIMPLE_RADIAL_FISHEYE", LensModel::kKannalaBrandt, "fxy0"},
    {"RADIAL_FISHEYE", LensModel::kKannalaBrandt, "fxy01"},
    {"FOV", LensModel::kFov, "hvxy0"},
};
constexpr double kHalfPixel = 0.5;

struct Line {
  int number = 0;
  std::vector<absl::string_view> words;
};

bool IsNumber(absl::string_view word) {
  double number = 0;
  return absl::SimpleAtod(word, &number);
}

/// The lines with a camera each.
std::vector<Line> Cameras(absl::string_view text) {
  std::vector<Line> lines;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view stripped = absl::StripAsciiWhitespace(line);
    if (stripped.empty() || stripped.front() == '#') continue;
    lines.push_back(
        {number, absl::StrSplit(stripped, absl::ByAnyChar(" \t\r"), absl::SkipEmpty())});
  }
  return lines;
}

bool RecognisesColmap(const CameraDocument& document) {
  const std::vector<Line> lines = Cameras(document.text);
  if (lines.empty() || lines[0].words.size() < 4) return false;
  const std::vector<absl::string_view>& words = lines[0].words;
  const bool capitals = std::all_of(words[1].begin(), words[1].end(), [](char each) {
    return absl::ascii_isupper(each) || absl::ascii_isdigit(each) || each == '_';
  });
  return IsNumber(words[0]) && capitals && !IsNumber(words[1]) && IsNumber(words[2]) &&
         IsNumber(words[3]);
}

absl::StatusOr<Line> ChooseColmapLine(const CameraDocument& document) {
  const std::vector<Line> lines = Cameras(document.text);
  std::vector<absl::string_view> ids;
  for (const Line& line : lines) {
    if (line.words[0] == document.camera) return line;
    ids.push_back(line.words[0]);
  }
  const std::string known =
      absl::StrJoin(ids.begin(), ids.begin() + std::min<std::ptrdiff_t>(10, std::ssize(ids)), ", ");
  if (!document.camera.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        document.file, ": ", document.camera, ": there is no such camera; the file has ", known));
  }
  if (lines.size() > 1) {
    Log(absl::StrCat(document.file, ": has cameras ", known, "; ", ids[0],
                     " is taken. Another: --camera ", document.file, "#", ids[1]));
  }
  return lines[0];
}

/// One parameter, by its letter.
void Put(char letter, double number, CameraDraft& draft) {
  CameraIntrinsics& lens = draft.lens;
  if (letter == 'f') lens.fx = lens.fy = number;
  if (letter == 'h') lens.fx = number;
  if (letter == 'v') lens.fy = number;
  if (letter == 'x') lens.cx = number - kHalfPixel;
  if (letter == 'y') lens.cy = number - kHalfPixel;
  if (letter >= '0' && letter <= '4')
    lens.distortion[static_cast<std::size_t>(letter - '0')] = number;
}

absl::Status TakeParameters(const Model& model, const std::vector<absl::string_view>& words,
                            CameraDraft& draft) {
  if (words.size() != 4 + model.parameters.size()) {
    return draft.Error("model", absl::StrCat(model.name, " has ", words.size() - 4,
                                             " parameters; it takes ", model.parameters.size()));
  }
  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    double number = 0;
    if (!absl::SimpleAtod(words[4 + i], &number) || !std::isfinite(number)) {
      return draft.Error("model", absl::StrCat("parameter ", i + 1, ": '", words[4 + i],
                                               "' is not a finite number"));
    }
    if (model.parameters[i] == 'z' && number != 0.0) {
      return draft.Error("model", absl::StrCat(model.name,
                                               " with k4 to k6 is not one of saccade's "
                                               "lenses; use OPENCV or OPENCV_FISHEYE"));
    }
    Put(model.parameters[i], number, draft);
  }
  draft.lens.model = model.lens;
  draft.told_lens = true;
  return absl::OkStatus();
}

absl::Status ReadColmap(CameraDocument& document, CameraDraft& draft) {
  const absl::StatusOr<Line> line = ChooseColmapLine(document);
  if (!line.ok()) return line.status();
  const std::vector<absl::string_view>& words = line->words;
  for (const char* field : {"model", "width", "height", "fx", "fy", "cx", "cy", "distortion"}) {
    draft.places[field] = {absl::StrCat("camera ", words[0]), line->number};
  }
  if (words.size() < 4 || !absl::SimpleAtoi(words[2], &draft.lens.width) ||
      !absl::SimpleAtoi(words[3], &draft.lens.height)) {
    return draft.Error("width", "write CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
  }
  draft.camera = std::string(words[0]);
  for (const Model& model : kModels) {
    if (model.name == words[1]) return TakeParameters(model, words, draft);
  }
  return draft.Error("model", absl::StrCat("'", words[1],
                                           "' is not one of saccade's lenses; use OPENCV, "
                                           "OPENCV_FISHEYE or FOV (colmap feature_extractor "
                                           "--ImageReader.camera_model)"));
}

}  // namespace

CameraForm ColmapForm() { return {"a COLMAP cameras.txt", RecognisesColmap, ReadColmap}; }

}  // namespace saccade
