#include "server/calibrate/grid_pictures.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

namespace saccade {
namespace {

constexpr std::size_t kLeastTags = 4;        // of a view in a calibration
constexpr std::size_t kMostFirstViews = 30;  // of the first lens: those that show most
constexpr int kRounds = 2;
constexpr std::size_t kFirstPictures = 8;

void Add(const MarkerSighting& sighting, const TagGrid& grid, BoardView& view) {
  const std::array<Eigen::Vector3d, 4> corners = grid.Corners(sighting.id);
  for (int k = 0; k < 4; ++k) {
    view.corners.emplace_back(sighting.corners[k].x(), sighting.corners[k].y());
    view.points.emplace_back(corners[k].x(), corners[k].y(), corners[k].z());
  }
}

BoardView ViewOf(std::size_t number, const std::vector<MarkerSighting>& sightings,
                 const TagGrid& grid, const std::string& family) {
  BoardView view;
  view.frame = number;
  view.time_ns = static_cast<Timestamp>(number) * 1'000'000'000;
  for (const MarkerSighting& sighting : sightings) {
    if (sighting.family == family && grid.Holds(sighting.id)) Add(sighting, grid, view);
  }
  return view;
}

}  // namespace

int BorderBitsOf(const PictureSet& pictures, const TagGrid& grid) {
  int most = 0, best = 2;
  for (const int bits : {2, 1}) {
    auto detector = MakeMarkerDetector("apriltag", {{grid.family}, bits});
    if (!detector.ok()) continue;
    int read = 0;
    for (std::size_t k = 0; k < std::min(pictures.size(), kFirstPictures); ++k) {
      const absl::StatusOr<cv::Mat> grey = pictures.load(k);
      if (grey.ok()) read += static_cast<int>((*detector)->Detect(*grey).size());
    }
    if (read > most) best = bits;
    most = std::max(most, read);
  }
  return best;
}

absl::StatusOr<GridPictures> GridPictures::Read(PictureSet set, const TagGrid& grid,
                                                int border_bits, const std::string& first,
                                                Progress progress, const LeftOut& left_out) {
  const int border = border_bits > 0 ? border_bits : BorderBitsOf(set, grid);
  absl::StatusOr<TagFamily> family = TagFamily::Make(grid.family, border);
  if (!family.ok()) return family.status();
  std::vector<std::unique_ptr<MarkerDetector>> detectors;
  for (const std::string& name : {first, std::string(first == "aruco" ? "apriltag" : "aruco")}) {
    auto detector = MakeMarkerDetector(name, {{grid.family}, border});
    if (!detector.ok()) return detector.status();
    detectors.push_back(*std::move(detector));
  }
  GridPictures pictures(std::move(set), grid, *std::move(family), std::move(progress));
  for (std::size_t k = 0; k < pictures.set_.size(); ++k) {
    if (absl::Status read = pictures.ReadOne(k, detectors); !read.ok()) left_out(read);
    pictures.progress_("reading", k + 1, pictures.set_.size());
  }
  return pictures;
}

absl::Status GridPictures::ReadOne(std::size_t number,
                                   const std::vector<std::unique_ptr<MarkerDetector>>& detectors) {
  const absl::StatusOr<cv::Mat> grey = set_.load(number);
  if (!grey.ok()) return grey.status();
  if (size_.empty()) size_ = grey->size();
  if (grey->size() != size_) {
    return absl::InvalidArgumentError(absl::StrCat(
        set_.names[number], ": is ", grey->cols, " x ", grey->rows, ", the others are ",
        size_.width, " x ", size_.height, "; give one camera's pictures"));
  }
  GridPicture picture;
  picture.number = number;
  for (const std::unique_ptr<MarkerDetector>& detector : detectors) {
    for (MarkerSighting& sighting : detector->Detect(*grey)) {
      const auto same = [&](const MarkerSighting& other) {
        return other.id == sighting.id && other.family == sighting.family;
      };
      if (std::none_of(picture.read.begin(), picture.read.end(), same)) {
        picture.read.push_back(std::move(sighting));
      }
    }
  }
  pictures_.push_back(std::move(picture));
  return absl::OkStatus();
}

std::vector<BoardView> GridPictures::ReadViews() const {
  std::vector<BoardView> views;
  for (std::size_t k = 0; k < pictures_.size(); ++k) {
    BoardView view = ViewOf(k, pictures_[k].read, grid_, family_.name());
    if (view.corners.size() >= 4 * kLeastTags) views.push_back(std::move(view));
  }
  std::stable_sort(views.begin(), views.end(), [](const BoardView& a, const BoardView& b) {
    return a.corners.size() > b.corners.size();
  });
  if (views.size() > kMostFirstViews) views.resize(kMostFirstViews);
  return views;
}

std::vector<BoardView> GridPictures::Views() const {
  std::vector<BoardView> views;
  for (std::size_t k = 0; k < pictures_.size(); ++k) {
    if (!pictures_[k].found) continue;
    BoardView view = ViewOf(k, pictures_[k].found->sightings, grid_, family_.name());
    if (view.corners.size() >= 4 * kLeastTags) views.push_back(std::move(view));
  }
  return views;
}

absl::Status GridPictures::Find(const CameraModel& camera) {
  for (std::size_t k = 0; k < pictures_.size(); ++k) {
    GridPicture& picture = pictures_[k];
    const absl::StatusOr<cv::Mat> grey = set_.load(picture.number);
    if (!grey.ok()) return grey.status();
    // From what was found before, where there is that: it was checked against the lens already.
    const std::optional<GridView> found = SearchGrid(
        *grey, camera, grid_, family_, picture.found ? picture.found->sightings : picture.read);
    if (found) picture.found = found;
    progress_("searching", k + 1, pictures_.size());
  }
  return absl::OkStatus();
}

absl::StatusOr<CalibratedLens> GridPictures::Search(LensChoice choice) {
  absl::StatusOr<CalibratedLens> fit = FitLens(ReadViews(), size_, choice);
  for (int round = 0; round < kRounds && fit.ok(); ++round) {
    if (absl::Status found = Find(CameraModel(fit->lens)); !found.ok()) return found;
    fit = FitLens(Views(), size_, choice);
  }
  return fit;
}

}  // namespace saccade
