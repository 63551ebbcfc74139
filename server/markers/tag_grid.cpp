#include "server/markers/tag_grid.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include "server/capture/yaml_reader.hpp"

namespace saccade {
namespace {

constexpr int kMostTags = 500;  // 36h11 has 587 codes
constexpr double kLeastTag_m = 0.001, kMostSide_m = 10.0;

}  // namespace

std::array<Eigen::Vector3d, 4> TagGrid::Corners(int id) const {
  const double pitch = side_m * (1 + spacing);
  const double left = id % columns * pitch, bottom = id / columns * pitch;
  const double right = left + side_m, top = bottom + side_m;
  return {{{left, bottom, 0}, {right, bottom, 0}, {right, top, 0}, {left, top, 0}}};
}

absl::StatusOr<TagGrid> LoadTagGrid(const std::filesystem::path& file) {
  YamlReader reader(file);
  TagGrid grid;
  if (reader.ok() && reader.Text("target_type") != "aprilgrid") {
    reader.Fail("target_type", "must be aprilgrid");
  }
  grid.columns = reader.Integer("tagCols", 1, kMostTags);
  grid.rows = reader.Integer("tagRows", 1, kMostTags);
  grid.side_m = reader.Number("tagSize", {kLeastTag_m, kMostSide_m});
  grid.spacing = reader.Number("tagSpacing", {0, 10});
  if (reader.ok() && grid.tags() > kMostTags) {
    reader.Fail("tagRows", absl::StrCat("makes more than ", kMostTags, " tags"));
  }
  if (!reader.ok()) return reader.status();
  return grid;
}

absl::StatusOr<TagGrid> ParseTagGrid(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  TagGrid grid;
  bool good = parts.size() == 3;
  if (good) {
    const std::vector<std::string> sides = absl::StrSplit(parts[0], 'x');
    good = sides.size() == 2 && absl::SimpleAtoi(sides[0], &grid.columns) &&
           absl::SimpleAtoi(sides[1], &grid.rows) && absl::SimpleAtod(parts[1], &grid.side_m) &&
           absl::SimpleAtod(parts[2], &grid.spacing);
  }
  if (good && grid.columns > 0 && grid.rows > 0 && grid.columns <= kMostTags &&
      grid.rows <= kMostTags && grid.tags() <= kMostTags && grid.side_m >= kLeastTag_m &&
      grid.side_m <= kMostSide_m && grid.spacing >= 0 && grid.spacing <= 10) {
    return grid;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("aprilgrid: '", text, "': give tags along both sides, the side of a tag in ",
                   "metres and the gap as a share of it, as in 6x6:0.088:0.3"));
}

}  // namespace saccade
