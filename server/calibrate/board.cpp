#include "server/calibrate/board.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kMostCorners = 100;
// Where the coarse search looks; it costs by the pixel.
constexpr int kSearchWidth_px = 800;

}  // namespace

std::vector<cv::Point3d> BoardPattern::Points() const {
  std::vector<cv::Point3d> points;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) points.emplace_back(i * square_m, j * square_m, 0.0);
  }
  return points;
}

std::string BoardPattern::Words() const {
  return absl::StrCat("board of ", columns, " x ", rows, " corners, ", square_m, " m");
}

absl::StatusOr<BoardPattern> ParseBoard(const std::string& board, double square_m) {
  const std::vector<std::string> sides = absl::StrSplit(board, absl::ByAnyChar("xX"));
  BoardPattern pattern;
  pattern.square_m = square_m;
  const bool good = sides.size() == 2 && absl::SimpleAtoi(sides[0], &pattern.columns) &&
                    absl::SimpleAtoi(sides[1], &pattern.rows);
  if (!good || pattern.columns < 3 || pattern.rows < 3 || pattern.columns > kMostCorners ||
      pattern.rows > kMostCorners) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--board: '", board, "': count the inner corners, where four squares meet, along both ",
        "sides: a chessboard of 10 x 7 squares is 9x6; at least 3x3"));
  }
  if (!(square_m >= 0.001 && square_m <= 10.0)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--square: ", square_m, ": the side of one square in metres, e.g. 0.025 for 25 mm"));
  }
  return pattern;
}

std::vector<cv::Point2d> FindBoard(const cv::Mat& grey, const BoardPattern& pattern) {
  // Most pictures of a live camera show no whole board: a small picture tells soonest.
  const double scale = std::min(1.0, static_cast<double>(kSearchWidth_px) / grey.cols);
  cv::Mat small = grey;
  if (scale < 1.0) cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  std::vector<cv::Point2f> found;
  if (!cv::findChessboardCornersSB(small, pattern.size(), found, cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return {};
  }
  double least = grey.cols;
  for (cv::Point2f& corner : found) {
    corner.x = static_cast<float>((corner.x + 0.5) / scale - 0.5);
    corner.y = static_cast<float>((corner.y + 0.5) / scale - 0.5);
  }
  for (std::size_t k = 1; k < found.size(); ++k) {
    least = std::min(least, cv::norm(found[k] - found[k - 1]));
  }
  // Its own corners are a tenth of a pixel off, all to one side; gradients are not.
  const int reach = std::clamp(static_cast<int>(0.3 * least), 2, 10);
  cv::cornerSubPix(grey, found, cv::Size(reach, reach), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.002));
  return {found.begin(), found.end()};
}

}  // namespace saccade
