#include "server/eval/team/wand_files.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "server/capture/yaml_reader.hpp"
#include "server/eval/team/number_table.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Path = std::filesystem::path;

Rigid3 PoseOf(const std::vector<double>& v) {
  return {ExpQuaternion({v[4], v[5], v[6]}), {v[1], v[2], v[3]}};
}

CameraModel ReadLens(YamlReader& lens) {
  lens.AllowOnly(
      {"camera_model", "distortion_model", "distortion_coeffs", "intrinsics", "resolution"});
  if (const std::string model = lens.Text("camera_model"); lens.ok() && model != "pinhole") {
    lens.Fail("camera_model", "is not pinhole");
  }
  const std::string kind = lens.Text("distortion_model");
  const bool fisheye = kind == "equidistant";
  if (lens.ok() && !fisheye && kind != "plumb_bob" && kind != "radtan") {
    lens.Fail("distortion_model", "is not plumb_bob, radtan or equidistant");
  }
  const std::vector<double> coefficients = lens.Numbers("distortion_coeffs", std::nullopt);
  if (lens.ok() && coefficients.size() != 4 && (fisheye || coefficients.size() != 5)) {
    lens.Fail("distortion_coeffs", "must have 4 numbers, or 5 of plumb_bob");
  }
  const std::vector<double> k = lens.Numbers("intrinsics", 4);
  const std::vector<double> size = lens.Numbers("resolution", 2, false, {1, 1e5});
  if (lens.ok() && !(k[0] > 0 && k[1] > 0)) lens.Fail("intrinsics", "fx and fy must be above 0");
  if (!lens.ok()) return CameraModel();
  CameraIntrinsics intrinsics;
  intrinsics.model = fisheye ? LensModel::kKannalaBrandt : LensModel::kBrownConrady;
  intrinsics.width = static_cast<int>(size[0]);
  intrinsics.height = static_cast<int>(size[1]);
  intrinsics.fx = k[0];
  intrinsics.fy = k[1];
  intrinsics.cx = k[2];
  intrinsics.cy = k[3];
  std::copy(coefficients.begin(), coefficients.end(), intrinsics.distortion.begin());
  return CameraModel(intrinsics);
}

absl::StatusOr<std::vector<CameraModel>> LoadLenses(const Path& file) {
  YamlReader yaml(file);
  if (!yaml.ok()) return yaml.status();
  std::vector<CameraModel> lenses;
  const std::size_t count = yaml.Keys().size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::string name = absl::StrCat("cam", k);
    if (!yaml.Has(name) || !yaml.IsMap(name)) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.string(), ": ", name, " is missing; name the cameras cam0, cam1, ..."));
    }
    YamlReader lens = yaml.Map(name);
    lenses.push_back(ReadLens(lens));
    if (!lens.ok()) return lens.status();
  }
  return lenses;
}

/// "tag side 0.12 m" in a comment.
std::optional<double> SideIn(const std::string& text) {
  const std::size_t at = text.find("tag side ");
  if (at == std::string::npos) return std::nullopt;
  const std::vector<std::string> words =
      absl::StrSplit(text.substr(at + 9, 32), absl::MaxSplits(' ', 1));
  double side_m = 0;
  if (!absl::SimpleAtod(words[0], &side_m) || !(side_m > 0 && side_m < 100)) return std::nullopt;
  return side_m;
}

absl::StatusOr<WandBody> LoadBody(const Path& file, double side_m) {
  const auto rows = LoadNumbers(file, 7, "tag, x, y, z [m], rotation vector [rad]");
  if (!rows.ok()) return rows.status();
  WandBody body;
  body.side_m = side_m;
  if (!(side_m > 0)) {
    const auto text = ReadRegularFile(file, std::size_t{1} << 20, "tags of a wand");
    if (!text.ok()) return text.status();
    const std::optional<double> side = SideIn(*text);
    if (!side) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.string(),
                       ": does not say how large the tags are; add a line `# tag "
                       "side 0.12 m` or use --set team.tag_side_m=0.12"));
    }
    body.side_m = *side;
  }
  for (const NumberRow& row : *rows) {
    const int tag = static_cast<int>(row.values[0]);
    if (row.values[0] != tag || !body.wand_from_tag.emplace(tag, PoseOf(row.values)).second) {
      return BadLine(file, row.line, "the tag's number is not whole, or was given before");
    }
  }
  return body;
}

absl::Status LoadSights(const Path& file, WandData& data) {
  const auto rows = LoadNumbers(file, 11, "time [s], camera, tag, x0, y0, ..., x3, y3 [px]");
  if (!rows.ok()) return rows.status();
  double last_s = 0;
  for (const NumberRow& row : *rows) {
    const std::vector<double>& v = row.values;
    if (!(v[0] >= last_s && v[0] > 0 && v[0] < 9e9)) {
      return BadLine(file, row.line, "its time is before the line above; sort the lines by time");
    }
    if (v[0] != last_s) data.times_ns.push_back(std::llround(v[0] * 1e6) * 1000);
    last_s = v[0];
    TagSight sight;
    sight.camera = static_cast<int>(v[1]);
    sight.tag = static_cast<int>(v[2]);
    sight.instant = static_cast<int>(data.times_ns.size()) - 1;
    if (v[1] != sight.camera || sight.camera < 0 ||
        sight.camera >= static_cast<int>(data.lenses.size())) {
      return BadLine(file, row.line, absl::StrCat("camera ", v[1], " is not in cameras.yaml"));
    }
    // Tags that are on no wand: of somebody else.
    if (v[2] != sight.tag || !data.body.wand_from_tag.contains(sight.tag)) continue;
    for (std::size_t k = 0; k < 4; ++k) sight.corners[k] = {v[3 + 2 * k], v[4 + 2 * k]};
    data.sights.push_back(sight);
  }
  if (data.sights.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ": none of its tags is in wand_tags.csv"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<WandData> LoadWand(const std::filesystem::path& folder, double side_m) {
  WandData data;
  absl::StatusOr<std::vector<CameraModel>> lenses = LoadLenses(folder / "cameras.yaml");
  if (!lenses.ok()) return lenses.status();
  data.lenses = *std::move(lenses);
  absl::StatusOr<WandBody> body = LoadBody(folder / "wand_tags.csv", side_m);
  if (!body.ok()) return body.status();
  data.body = *std::move(body);
  if (absl::Status read = LoadSights(folder / "detections.csv", data); !read.ok()) return read;
  if (const Path file = folder / "reference_wand.tum"; MayExist(file)) {
    absl::StatusOr<Trajectory> reference = LoadTrajectory(file);
    if (!reference.ok()) return reference.status();
    data.reference_wand = *std::move(reference);
  }
  if (const Path file = folder / "reference_cameras.csv"; MayExist(file)) {
    const auto rows = LoadNumbers(file, 7, "camera, x, y, z [m], rotation vector [rad]");
    if (!rows.ok()) return rows.status();
    for (const NumberRow& row : *rows) {
      data.reference_cameras[static_cast<int>(row.values[0])] = PoseOf(row.values);
    }
  }
  return data;
}

}  // namespace saccade
