#include "server/calibrate/target_grid.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <array>
#include <optional>
#include <vector>

#include "server/markers/grid_search.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/markers/tag_family.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastTags = 4;
constexpr int kMostMarkers = 1000;
constexpr double kLeastSide_m = 0.001, kMostSide_m = 10.0;

void Add(const std::array<Eigen::Vector2d, 4>& corners,
         const std::array<Eigen::Vector3d, 4>& points, BoardView& view) {
  for (int k = 0; k < 4; ++k) {
    view.corners.emplace_back(corners[k].x(), corners[k].y());
    view.points.emplace_back(points[k].x(), points[k].y(), points[k].z());
  }
}

std::string Missing() { return absl::StrCat("fewer than ", kLeastTags, " tags in view"); }

class AprilGrid final : public LensTarget {
 public:
  AprilGrid(const TagGrid& grid, std::vector<int> borders)
      : LensTarget(
            absl::StrCat("aprilgrid of ", grid.columns, " x ", grid.rows, ", ", grid.side_m, " m"),
            Missing()),
        grid_(grid) {
    for (const int bits : borders) {
      auto detector = MakeMarkerDetector("apriltag", {{grid.family}, bits});
      absl::StatusOr<TagFamily> family = TagFamily::Make(grid.family, bits);
      if (detector.ok() && family.ok()) {
        borders_.push_back({*std::move(detector), *std::move(family)});
      }
    }
  }

  void Find(const cv::Mat& grey, BoardView& view) override {
    std::size_t best = 0;
    std::vector<MarkerSighting> most;
    for (std::size_t b = 0; b < borders_.size(); ++b) {
      std::vector<MarkerSighting> read = borders_[b].detector->Detect(grey);
      if (b > 0 && read.size() <= most.size()) continue;
      best = b;
      most = std::move(read);
    }
    Put(most, view);
    // What a sheet's border is does not change.
    if (!view.corners.empty() && borders_.size() > 1) {
      if (best != 0) std::swap(borders_[0], borders_[best]);
      borders_.erase(borders_.begin() + 1, borders_.end());
    }
  }

  bool Refine(const cv::Mat& grey, const CameraModel& camera, BoardView& view) override {
    const std::optional<GridView> found =
        SearchGrid(grey, camera, grid_, borders_[0].family, borders_[0].detector->Detect(grey));
    view.corners.clear();
    view.points.clear();
    if (found) Put(found->sightings, view);
    return !view.corners.empty();
  }
  bool refines() const override { return true; }

 private:
  struct Border {
    std::unique_ptr<MarkerDetector> detector;
    TagFamily family;
  };
  void Put(const std::vector<MarkerSighting>& sightings, BoardView& view) const {
    for (const MarkerSighting& sighting : sightings) {
      if (sighting.family != grid_.family || !grid_.Holds(sighting.id)) continue;
      Add(sighting.corners, grid_.Corners(sighting.id), view);
    }
    if (view.corners.size() >= 4 * kLeastTags) return;
    view.corners.clear();
    view.points.clear();
  }

  TagGrid grid_;
  std::vector<Border> borders_;
};

/// OpenCV's grid board: ids rise from the upper left along the rows.
struct ArucoGridPattern {
  int columns = 0, rows = 0;
  double side_m = 0, gap_m = 0;
  std::string family = "aruco_4x4_50";

  std::array<Eigen::Vector3d, 4> Corners(int id) const {
    const double left = id % columns * (side_m + gap_m), top = id / columns * (side_m + gap_m);
    const double right = left + side_m, bottom = top + side_m;
    return {{{left, top, 0}, {right, top, 0}, {right, bottom, 0}, {left, bottom, 0}}};
  }
};

class ArucoGrid final : public LensTarget {
 public:
  ArucoGrid(ArucoGridPattern pattern, std::unique_ptr<MarkerDetector> detector)
      : LensTarget(absl::StrCat("ArUco grid of ", pattern.columns, " x ", pattern.rows,
                                " markers, ", pattern.side_m, " m"),
                   Missing()),
        pattern_(std::move(pattern)),
        detector_(std::move(detector)) {}

  void Find(const cv::Mat& grey, BoardView& view) override {
    const std::vector<MarkerSighting> read = detector_->Detect(grey);
    for (const MarkerSighting& sighting : read) {
      if (sighting.id >= pattern_.columns * pattern_.rows) continue;
      Add(sighting.corners, pattern_.Corners(sighting.id), view);
    }
    if (view.corners.size() >= 4 * kLeastTags) return;
    view.corners.clear();
    view.points.clear();
  }

 private:
  ArucoGridPattern pattern_;
  std::unique_ptr<MarkerDetector> detector_;
};

}  // namespace

absl::StatusOr<TagGrid> TagGridOf(const std::string& text) {
  return MayExist(text) ? LoadTagGrid(text) : ParseTagGrid(text);
}

absl::StatusOr<std::unique_ptr<LensTarget>> MakeAprilGrid(const std::string& text,
                                                          int border_bits) {
  const absl::StatusOr<TagGrid> grid = TagGridOf(text);
  if (!grid.ok()) return grid.status();
  const int least = border_bits > 0 ? border_bits : 1;
  if (const auto family = TagFamily::Make(grid->family, least); !family.ok()) {
    return family.status();
  }
  return std::make_unique<AprilGrid>(
      *grid, border_bits > 0 ? std::vector<int>{border_bits} : std::vector<int>{2, 1});
}

absl::StatusOr<std::unique_ptr<LensTarget>> MakeArucoGrid(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  ArucoGridPattern pattern;
  bool good = parts.size() == 3 || parts.size() == 4;
  if (good) {
    const std::vector<std::string> sides = absl::StrSplit(parts[0], 'x');
    good = sides.size() == 2 && absl::SimpleAtoi(sides[0], &pattern.columns) &&
           absl::SimpleAtoi(sides[1], &pattern.rows) &&
           absl::SimpleAtod(parts[1], &pattern.side_m) &&
           absl::SimpleAtod(parts[2], &pattern.gap_m);
  }
  good = good && pattern.columns > 0 && pattern.rows > 0 && pattern.columns <= kMostMarkers &&
         pattern.rows <= kMostMarkers && pattern.columns * pattern.rows <= kMostMarkers &&
         pattern.side_m >= kLeastSide_m && pattern.side_m <= kMostSide_m && pattern.gap_m >= 0 &&
         pattern.gap_m <= kMostSide_m;
  if (!good) {
    return absl::InvalidArgumentError(absl::StrCat(
        "target: 'arucogrid:", text,
        "': give markers along both sides, the side of a marker and the gap between two in metres, "
        "and their family if it is not aruco_4x4_50, as in arucogrid:5x7:0.04:0.01:aruco_6x6_250"));
  }
  if (parts.size() == 4) pattern.family = parts[3];
  auto detector = MakeMarkerDetector("aruco", {{pattern.family}});
  if (!detector.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("target: ", detector.status().message()));
  }
  return std::make_unique<ArucoGrid>(std::move(pattern), *std::move(detector));
}

}  // namespace saccade
