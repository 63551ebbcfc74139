#include "server/markers/charuco.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "server/markers/aruco_detector.hpp"

namespace saccade {
namespace {

constexpr int kMostSquares = 50;  // along a side
constexpr double kLeastCharucoSide_m = 0.001, kMostCharucoSide_m = 10.0;
constexpr int kMarkersBeside = 2;  // of a corner: with one its place is a guess

}  // namespace

absl::StatusOr<CharucoPattern> ParseCharuco(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  CharucoPattern pattern;
  const std::vector<std::string> sides = absl::StrSplit(parts[0], absl::ByAnyChar("xX"));
  const bool read = (parts.size() == 3 || parts.size() == 4) && sides.size() == 2 &&
                    absl::SimpleAtoi(sides[0], &pattern.columns) &&
                    absl::SimpleAtoi(sides[1], &pattern.rows) &&
                    absl::SimpleAtod(parts[1], &pattern.square_m) &&
                    absl::SimpleAtod(parts[2], &pattern.marker_m);
  if (!read || pattern.columns < 3 || pattern.rows < 3 || pattern.columns > kMostSquares ||
      pattern.rows > kMostSquares) {
    return absl::InvalidArgumentError(absl::StrCat(
        "charuco: '", text, "': give squares along both sides (3 to ", kMostSquares,
        "), the side of a square and of a marker in metres, as in 7x5:0.04:0.03, and where they "
        "are no aruco_4x4_50 the markers' family, as in 7x5:0.04:0.03:aruco_5x5_250"));
  }
  if (!(pattern.square_m >= kLeastCharucoSide_m && pattern.square_m <= kMostCharucoSide_m) ||
      !(pattern.marker_m >= kLeastCharucoSide_m && pattern.marker_m < pattern.square_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat("charuco: '", text, "': a square's side is from ", kLeastCharucoSide_m, " to ",
                     kMostCharucoSide_m, " m, and a marker's is less than that"));
  }
  if (parts.size() == 4) pattern.family = parts[3];
  return pattern;
}

absl::StatusOr<CharucoDetector> CharucoDetector::Make(const CharucoPattern& pattern) {
  const absl::StatusOr<ArucoFamily> family = MakeArucoFamily(pattern.family);
  if (!family.ok()) return family.status();
  if (pattern.columns * pattern.rows / 2 > family->dictionary->bytesList.rows) {
    return absl::InvalidArgumentError(absl::StrCat(
        "charuco: a board of ", pattern.columns, " x ", pattern.rows, " squares needs ",
        pattern.columns * pattern.rows / 2, " markers, and ", pattern.family, " has ",
        family->dictionary->bytesList.rows, "; name the family that it was printed from"));
  }
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->adaptiveThreshWinSizeMin = 3;
  parameters->adaptiveThreshWinSizeMax = 43;
  parameters->minMarkerPerimeterRate = 0.01;
  return CharucoDetector(cv::aruco::CharucoBoard::create(
                             pattern.columns, pattern.rows, static_cast<float>(pattern.square_m),
                             static_cast<float>(pattern.marker_m), family->dictionary),
                         std::move(parameters));
}

std::vector<CharucoCorner> CharucoDetector::Detect(const cv::Mat& grey) const {
  if (grey.empty() || grey.type() != CV_8UC1) return {};
  std::vector<std::vector<cv::Point2f>> markers, refused;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, board_->dictionary, markers, ids, parameters_, refused);
  if (ids.empty()) return {};
  std::vector<cv::Point2f> pixels;
  std::vector<int> corner_ids;
  cv::aruco::interpolateCornersCharuco(markers, ids, grey, board_, pixels, corner_ids, {}, {},
                                       kMarkersBeside);
  if (pixels.empty()) return {};
  float nearest = static_cast<float>(grey.cols);
  for (std::size_t k = 1; k < pixels.size(); ++k) {
    if (corner_ids[k] != corner_ids[k - 1] + 1) continue;
    nearest = std::min(nearest, static_cast<float>(cv::norm(pixels[k] - pixels[k - 1])));
  }
  // As FindBoard's: over a part of the square, so that no marker's edge is in it.
  const int reach = std::clamp(static_cast<int>(0.12F * nearest), 2, 8);
  cv::cornerSubPix(grey, pixels, cv::Size(reach, reach), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.002));
  std::vector<CharucoCorner> corners;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const cv::Point3f& point = board_->chessboardCorners[static_cast<std::size_t>(corner_ids[k])];
    corners.push_back({corner_ids[k], {pixels[k].x, pixels[k].y}, {point.x, point.y, point.z}});
  }
  std::sort(corners.begin(), corners.end(),
            [](const CharucoCorner& a, const CharucoCorner& b) { return a.id < b.id; });
  return corners;
}

}  // namespace saccade
