#include "server/calibrate/target.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "server/calibrate/target_grid.hpp"
#include "server/markers/charuco.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastCorners = 8;  // of a view of a board that may be partly hidden

class Chessboard final : public LensTarget {
 public:
  explicit Chessboard(const BoardPattern& pattern)
      : LensTarget(pattern.Words(), "no whole board in view"), pattern_(pattern) {}
  void Find(const cv::Mat& grey, BoardView& view) override {
    view.corners = FindBoard(grey, pattern_);
    view.points = pattern_.Points();
  }

 private:
  BoardPattern pattern_;
};

class Charuco final : public LensTarget {
 public:
  Charuco(const CharucoPattern& pattern, CharucoDetector detector)
      : LensTarget(absl::StrCat("ChArUco board of ", pattern.columns, " x ", pattern.rows,
                                " squares, ", pattern.square_m, " m"),
                   absl::StrCat("fewer than ", kLeastCorners, " corners of the board in view")),
        detector_(std::move(detector)) {}
  void Find(const cv::Mat& grey, BoardView& view) override {
    const std::vector<CharucoCorner> corners = detector_.Detect(grey);
    if (corners.size() < kLeastCorners) return;
    for (const CharucoCorner& corner : corners) {
      view.corners.emplace_back(corner.pixel.x(), corner.pixel.y());
      view.points.emplace_back(corner.point_m.x(), corner.point_m.y(), corner.point_m.z());
    }
  }

 private:
  CharucoDetector detector_;
};

absl::StatusOr<std::unique_ptr<LensTarget>> MakeChessboard(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  double square_m = 0;
  const bool read = parts.size() == 2 && absl::SimpleAtod(parts[1], &square_m);
  const absl::StatusOr<BoardPattern> pattern =
      read ? ParseBoard(parts[0], square_m) : absl::InvalidArgumentError("");
  if (pattern.ok()) return std::make_unique<Chessboard>(*pattern);
  return absl::InvalidArgumentError(absl::StrCat(
      "target: 'chessboard:", text,
      "': give the inner corners along both sides, where four squares meet (3x3 to 100x100; a "
      "board of 10 x 7 squares has 9x6), and the side of a square in metres (0.001 to 10), as in "
      "chessboard:9x6:0.04"));
}

absl::StatusOr<std::unique_ptr<LensTarget>> MakeCharuco(const std::string& text) {
  const absl::StatusOr<CharucoPattern> pattern = ParseCharuco(text);
  absl::StatusOr<CharucoDetector> detector =
      pattern.ok() ? CharucoDetector::Make(*pattern) : pattern.status();
  if (detector.ok()) return std::make_unique<Charuco>(*pattern, *std::move(detector));
  return absl::InvalidArgumentError(absl::StrCat("target: ", detector.status().message()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<LensTarget>> MakeLensTarget(const std::string& text,
                                                           int border_bits) {
  absl::string_view rest = text;
  if (absl::ConsumePrefix(&rest, "chessboard:")) return MakeChessboard(std::string(rest));
  if (absl::ConsumePrefix(&rest, "charuco:")) return MakeCharuco(std::string(rest));
  if (absl::ConsumePrefix(&rest, "aprilgrid:")) {
    return MakeAprilGrid(std::string(rest), border_bits);
  }
  if (absl::ConsumePrefix(&rest, "arucogrid:")) return MakeArucoGrid(std::string(rest));
  return absl::InvalidArgumentError(
      absl::StrCat("target: '", text,
                   "' is none; give chessboard:9x6:0.04, charuco:7x5:0.04:0.03, "
                   "aprilgrid:6x6:0.088:0.3, aprilgrid:FILE.yaml or arucogrid:5x7:0.04:0.01"));
}

}  // namespace saccade
