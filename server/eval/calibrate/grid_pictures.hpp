#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/eval/calibrate/lens_fit.hpp"
#include "server/markers/grid_search.hpp"
#include "server/markers/marker_detector.hpp"

namespace saccade {

/// One picture of a sheet of tags.
struct GridPicture {
  std::filesystem::path file;
  std::vector<MarkerSighting> read;  // what detectors read, of any family
  std::optional<GridView> found;     // after the search, if the sheet was found
};

/// A sheet of tags in many pictures of one camera: what can be read, and a lens by which all of it
/// is found.
/// How wide the border of the tags in these pictures is, 2 (Kalibr's own sheets) or 1: what reads
/// more of them in the first pictures.
int BorderBitsOf(const std::vector<std::filesystem::path>& files, const TagGrid& grid);

class GridPictures {
 public:
  /// Told what is going on: "reading", done, all.
  using Progress = std::function<void(const std::string& step, std::size_t done, std::size_t all)>;

  GridPictures(const TagGrid& grid, TagFamily family, Progress progress)
      : grid_(grid), family_(std::move(family)), progress_(std::move(progress)) {}

  /// Reads `file` with each of `detectors`; the first that reads a tag keeps it. A file that is no
  /// picture, or another's size than the ones before, is an error, and the next may be read.
  absl::Status Read(const std::filesystem::path& file,
                    const std::vector<std::unique_ptr<MarkerDetector>>& detectors);
  /// Finds a lens of `model` from what was read, with it all tags in all pictures, and a better
  /// lens from these, twice. FailedPrecondition: the tags fit no lens.
  absl::StatusOr<LensFit> Search(LensModel model);

  /// What was found, as a calibration takes it: a picture with fewer than four tags has no view.
  std::vector<BoardView> Views() const;
  const std::vector<GridPicture>& pictures() const { return pictures_; }
  cv::Size size() const { return size_; }

 private:
  std::vector<BoardView> ReadViews() const;
  absl::Status Find(const CameraModel& camera);

  TagGrid grid_;
  TagFamily family_;
  Progress progress_;
  std::vector<GridPicture> pictures_;
  cv::Size size_;
};

}  // namespace saccade
