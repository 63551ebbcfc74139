#include "server/eval/calibrate/target_views.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <functional>
#include <iostream>

#include "server/eval/calibrate/grid_pictures.hpp"
#include "server/markers/charuco.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastCorners = 8;  // of a view of a board that may be partly hidden

void SayProgress(const std::string& step, std::size_t done, std::size_t all) {
  if (done % 20 == 0 || done == all) std::cerr << step << ": " << done << " of " << all << "\n";
}

void SayLeftOut(absl::string_view why) { std::cerr << "left out: " << why << "\n"; }

/// Each picture by itself, with `find`, which gives corners and their points; none: not in view.
TargetViews FindInEach(const PictureSet& pictures, std::string words,
                       const std::function<void(const cv::Mat& grey, BoardView& view)>& find,
                       const std::string& missing) {
  TargetViews seen{{}, std::move(words), {}};
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const absl::StatusOr<cv::Mat> grey = pictures.load(k);
    SayProgress("reading", k + 1, pictures.size());
    if (!grey.ok()) {
      SayLeftOut(grey.status().message());
      continue;
    }
    if (seen.size.empty()) seen.size = grey->size();
    if (grey->size() != seen.size) {
      SayLeftOut(absl::StrCat(pictures.names[k], ": is of another size than those before"));
      continue;
    }
    BoardView view;
    view.frame = k;
    view.time_ns = static_cast<Timestamp>(k) * 1'000'000'000;
    find(*grey, view);
    if (view.corners.empty()) {
      SayLeftOut(absl::StrCat(pictures.names[k], ": ", missing));
    } else {
      seen.views.push_back(std::move(view));
    }
  }
  return seen;
}

absl::StatusOr<TargetViews> FindChessboard(const PictureSet& pictures, const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  double square_m = 0;
  const bool read = parts.size() == 2 && absl::SimpleAtod(parts[1], &square_m);
  const absl::StatusOr<BoardPattern> pattern =
      read ? ParseBoard(parts[0], square_m) : absl::InvalidArgumentError("");
  if (!pattern.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--target: 'chessboard:", text,
        "': give the inner corners along both sides, where four squares meet (3x3 to 100x100; a "
        "board of 10 x 7 squares has 9x6), and the side of a square in metres (0.001 to 10), as in "
        "chessboard:9x6:0.04"));
  }
  return FindInEach(
      pictures, pattern->Words(),
      [&](const cv::Mat& grey, BoardView& view) {
        view.corners = FindBoard(grey, *pattern);
        view.points = pattern->Points();
      },
      "no whole board in view");
}

absl::StatusOr<TargetViews> FindCharuco(const PictureSet& pictures, const std::string& text) {
  const absl::StatusOr<CharucoPattern> pattern = ParseCharuco(text);
  const absl::StatusOr<CharucoDetector> detector =
      pattern.ok() ? CharucoDetector::Make(*pattern) : pattern.status();
  if (!detector.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("--target: ", detector.status().message()));
  }
  return FindInEach(
      pictures,
      absl::StrCat("ChArUco board of ", pattern->columns, " x ", pattern->rows, " squares, ",
                   pattern->square_m, " m"),
      [&](const cv::Mat& grey, BoardView& view) {
        const std::vector<CharucoCorner> corners = detector->Detect(grey);
        if (corners.size() < kLeastCorners) return;
        for (const CharucoCorner& corner : corners) {
          view.corners.emplace_back(corner.pixel.x(), corner.pixel.y());
          view.points.emplace_back(corner.point_m.x(), corner.point_m.y(), corner.point_m.z());
        }
      },
      absl::StrCat("fewer than ", kLeastCorners, " corners of the board in view"));
}

absl::StatusOr<TargetViews> FindGrid(const PictureSet& pictures, const std::string& text,
                                     int border_bits) {
  const absl::StatusOr<TagGrid> grid = MayExist(text) ? LoadTagGrid(text) : ParseTagGrid(text);
  if (!grid.ok()) return grid.status();
  absl::StatusOr<GridPictures> read =
      GridPictures::Read(pictures, *grid, border_bits, "apriltag", SayProgress,
                         [](const absl::Status& why) { SayLeftOut(why.message()); });
  if (!read.ok()) return read.status();
  const absl::StatusOr<LensFit> fit = read->Search(LensModel::kBrownConrady);
  if (!fit.ok()) return fit.status();
  return TargetViews{
      read->Views(),
      absl::StrCat("aprilgrid of ", grid->columns, " x ", grid->rows, ", ", grid->side_m, " m"),
      read->size()};
}

}  // namespace

absl::StatusOr<TargetViews> FindTarget(const PictureSet& pictures, const std::string& target,
                                       int border_bits) {
  absl::string_view rest = target;
  if (absl::ConsumePrefix(&rest, "chessboard:")) {
    return FindChessboard(pictures, std::string(rest));
  }
  if (absl::ConsumePrefix(&rest, "charuco:")) return FindCharuco(pictures, std::string(rest));
  if (absl::ConsumePrefix(&rest, "aprilgrid:")) {
    return FindGrid(pictures, std::string(rest), border_bits);
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "--target: '", target,
      "' is none; give chessboard:9x6:0.04, charuco:7x5:0.04:0.03, aprilgrid:6x6:0.088:0.3, "
      "aprilgrid:FILE.yaml or walls:FILE.yaml"));
}

}  // namespace saccade
