#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "server/features/image_pyramid.hpp"

namespace saccade {

struct CornerOptions {
  /// Side of the summation window at full resolution [px], odd, 9 to 15 (slam-spec 5.1).
  int window_px = 11;
  /// Smallest min-eigenvalue of the window's sum of central-difference gradient products
  /// ((I(x+1) - I(x-1)) / 2, 8-bit grey) that counts as a corner, for an 11 x 11 window at full
  /// resolution; scores of other windows and levels are scaled to it. slam-spec 5.1: 20000.
  double min_score = 20000.0;
  /// Corners keep at least this distance from the picture's border [px].
  int border_px = 20;
  /// Side of a bucket [px]: at most one corner a cell and a call.
  int cell_px = 32;
  /// Corners keep at least this distance from occupied pixels and from each other [px].
  double min_distance_px = 12.0;
  /// Pyramid level the score is computed on: 0, or 1 (a quarter of the cost).
  int level = 0;
  /// Rows of cells that DetectNextBand() looks at in one call.
  int band_cells = 3;

  absl::Status Validate() const;
};

/// A corner, best first in the lists below.
struct Corner {
  Eigen::Vector2d pixel;  // full resolution, sub-pixel
  double score = 0.0;     // min eigenvalue as CornerOptions::min_score
};

/// Shi-Tomasi corners, one per grid cell, over the picture or over a part of it.
///
/// Cost is proportional to the region's area; a frame can therefore pay for one band of rows and
/// leave the rest to the frames after it. One thread; scratch memory is reused.
class CornerDetector {
 public:
  explicit CornerDetector(const CornerOptions& options);

  const CornerOptions& options() const { return options_; }

  /// Best corners of `region` (clipped to the picture less the border), at most `max_corners`,
  /// sorted by score, away from `occupied` (non-finite entries are ignored). `corners` is replaced.
  void Detect(const ImagePyramid& pyramid, cv::Rect region,
              std::span<const Eigen::Vector2d> occupied, int max_corners,
              std::vector<Corner>& corners);

  /// The same over the whole picture.
  void DetectAll(const ImagePyramid& pyramid, std::span<const Eigen::Vector2d> occupied,
                 int max_corners, std::vector<Corner>& corners);

  /// The same over the next band of `band_cells` rows of cells, round robin from call to call.
  /// Returns the band that was looked at.
  cv::Rect DetectNextBand(const ImagePyramid& pyramid, std::span<const Eigen::Vector2d> occupied,
                          int max_corners, std::vector<Corner>& corners);

  /// The same over the emptiest band: the one whose cells hold the fewest occupied pixels per area.
  /// A band is not chosen again within the next `bands / 2` calls, so a blank wall starves nobody.
  cv::Rect DetectEmptiestBand(const ImagePyramid& pyramid,
                              std::span<const Eigen::Vector2d> occupied, int max_corners,
                              std::vector<Corner>& corners);

 private:
  /// Min eigenvalue over `area` of `image` into score_, which gets the area's size. Reads up to
  /// window / 2 + 1 pixels outside the area, which must lie inside the image.
  void Score(const cv::Mat& image, const cv::Rect& area, int window);
  /// Best unoccupied pixel of each cell into candidates_; `area` and score_ are of the level.
  void BestOfCells(const cv::Rect& area, double to_spec, std::span<const Eigen::Vector2d> occupied);
  void BlankOccupied(const cv::Rect& area, std::span<const Eigen::Vector2d> occupied);
  int Bands(const ImagePyramid& pyramid) const;
  cv::Rect Band(const ImagePyramid& pyramid, int index) const;

  CornerOptions options_;
  int next_band_ = 0;
  std::vector<int> band_used_;  // call number at which a band was last chosen
  int calls_ = 0;
  cv::Mat score_;  // CV_32FC1
  std::vector<int> column_sums_;
  std::vector<int> products_;
  std::vector<Corner> candidates_;
};

}  // namespace saccade
