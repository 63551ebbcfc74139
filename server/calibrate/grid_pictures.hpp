#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/calibrate/lens_fit.hpp"
#include "server/calibrate/picture_set.hpp"
#include "server/markers/grid_search.hpp"
#include "server/markers/marker_detector.hpp"

namespace saccade {

/// One picture of a sheet of tags.
struct GridPicture {
  std::size_t number = 0;            // in the set
  std::vector<MarkerSighting> read;  // what detectors read, of any family
  std::optional<GridView> found;     // after the search, if the sheet was found
};

/// How wide the border of the tags in these pictures is, 2 (Kalibr's own sheets) or 1: what reads
/// more of them in the first pictures.
int BorderBitsOf(const PictureSet& pictures, const TagGrid& grid);

/// A sheet of tags in many pictures of one camera: what can be read, and a lens by which all of it
/// is found.
class GridPictures {
 public:
  /// Told what is going on: "reading", done, all.
  using Progress = std::function<void(const std::string& step, std::size_t done, std::size_t all)>;

  /// Told of a picture that is none, or is of another size than those before.
  using LeftOut = std::function<void(const absl::Status& why)>;

  /// Reads all pictures with both detectors: what `first` (apriltag, aruco) reads, and what only
  /// the other one does. `border_bits` 0: BorderBitsOf().
  static absl::StatusOr<GridPictures> Read(PictureSet set, const TagGrid& grid, int border_bits,
                                           const std::string& first, Progress progress,
                                           const LeftOut& left_out);
  /// Finds a lens of `model` from what was read, with it all tags in all pictures, and a better
  /// lens from these, twice. FailedPrecondition: the tags fit no lens.
  absl::StatusOr<CalibratedLens> Search(LensChoice choice);

  /// What was found, as a calibration takes it: a picture with fewer than four tags has no view.
  std::vector<BoardView> Views() const;
  const std::vector<GridPicture>& pictures() const { return pictures_; }
  const PictureSet& set() const { return set_; }
  cv::Size size() const { return size_; }

 private:
  GridPictures(PictureSet set, const TagGrid& grid, TagFamily family, Progress progress)
      : set_(std::move(set)),
        grid_(grid),
        family_(std::move(family)),
        progress_(std::move(progress)) {}
  absl::Status ReadOne(std::size_t number,
                       const std::vector<std::unique_ptr<MarkerDetector>>& detectors);
  std::vector<BoardView> ReadViews() const;
  absl::Status Find(const CameraModel& camera);

  PictureSet set_;
  TagGrid grid_;
  TagFamily family_;
  Progress progress_;
  std::vector<GridPicture> pictures_;
  cv::Size size_;
};

}  // namespace saccade
