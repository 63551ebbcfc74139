#include "server/markers/marker_pattern.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include "server/markers/aruco_detector.hpp"
#include "server/markers/koller_code.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/markers/tag_family.hpp"

namespace saccade {
namespace {

constexpr int kKollerGrid = 8;  // its frame is one wide, its cells two
const std::array<Eigen::Vector2d, 4> kClockwise = {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0),
                                                   Eigen::Vector2d(1, 1), Eigen::Vector2d(0, 1)};
const std::array<Eigen::Vector2d, 4> kAprilTags = {Eigen::Vector2d(0, 1), Eigen::Vector2d(1, 1),
                                                   Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 0)};

MarkerPattern Black(int cells, const std::array<Eigen::Vector2d, 4>& corners) {
  MarkerPattern pattern;
  pattern.cells = cells;
  pattern.shades.assign(static_cast<std::size_t>(cells) * cells, CellShade::kBlack);
  pattern.corners = corners;
  return pattern;
}

absl::Status CheckId(const std::string& family, int id, int ids) {
  if (id >= 0 && id < ids) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("ids: ", family, " has 0 to ", ids - 1, ", not ", id));
}

absl::StatusOr<MarkerPattern> KollerPattern(int id) {
  if (absl::Status known = CheckId(kKollerFamily, id, kKollerIds); !known.ok()) return known;
  MarkerPattern pattern = Black(kKollerGrid, kClockwise);
  const KollerCells red = KollerCellsOf(id);
  for (int row = 1; row < kKollerGrid - 1; ++row) {
    for (int column = 1; column < kKollerGrid - 1; ++column) {
      if (red[3 * ((row - 1) / 2) + (column - 1) / 2]) {
        pattern.shades[row * kKollerGrid + column] = CellShade::kRed;
      }
    }
  }
  return pattern;
}

absl::StatusOr<MarkerPattern> AprilTagPattern(const TagFamily& family, int id) {
  if (absl::Status known = CheckId(family.name(), id, family.codes()); !known.ok()) return known;
  MarkerPattern pattern = Black(family.cells(), kAprilTags);
  for (const TagFamily::Bit& bit : family.Bits(id)) {
    if (bit.row < 0 || bit.column < 0 || bit.row >= pattern.cells || bit.column >= pattern.cells) {
      return absl::InvalidArgumentError(
          absl::StrCat("family: ", family.name(), " has code outside of its border"));
    }
    if (bit.bright) pattern.shades[bit.row * pattern.cells + bit.column] = CellShade::kWhite;
  }
  return pattern;
}

absl::StatusOr<MarkerPattern> ArucoPattern(const ArucoFamily& family, int id) {
  if (absl::Status known = CheckId(family.name, id, family.dictionary->bytesList.rows);
      !known.ok()) {
    return known;
  }
  MarkerPattern pattern = Black(family.dictionary->markerSize + 2, kClockwise);
  cv::Mat drawn;
  family.dictionary->drawMarker(id, pattern.cells, drawn, 1);
  for (int k = 0; k < pattern.cells * pattern.cells; ++k) {
    if (drawn.at<std::uint8_t>(k / pattern.cells, k % pattern.cells) != 0) {
      pattern.shades[k] = CellShade::kWhite;
    }
  }
  return pattern;
}

}  // namespace

absl::StatusOr<MarkerPattern> PatternOf(const std::string& family, int id) {
  if (family == kKollerFamily) return KollerPattern(id);
  if (absl::StartsWith(family, "apriltag")) {
    const absl::StatusOr<TagFamily> tags = TagFamily::Make(family, 1);
    if (!tags.ok()) return tags.status();
    return AprilTagPattern(*tags, id);
  }
  const absl::StatusOr<ArucoFamily> aruco = MakeArucoFamily(family);
  if (aruco.ok()) return ArucoPattern(*aruco, id);
  return absl::InvalidArgumentError(absl::StrCat(
      "family: there is no '", family, "'; there are ", kKollerFamily, ", ",
      absl::StrJoin(TagFamilyNames(), ", "), ", ", absl::StrJoin(ArucoFamilyNames(), ", ")));
}

}  // namespace saccade
