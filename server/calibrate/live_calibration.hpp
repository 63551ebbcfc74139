#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/calibrate/best_lens.hpp"
#include "server/calibrate/target.hpp"
#include "server/calibrate/view_picker.hpp"

namespace saccade {

/// A calibration while somebody shows the target: looks at pictures, keeps the views that add
/// something, says what to do next, and finds the lens. One thread.
class LiveCalibration {
 public:
  LiveCalibration(std::unique_ptr<LensTarget> target, cv::Size picture)
      : target_(std::move(target)), picture_(picture), picker_(picture) {}

  struct Look {
    std::vector<cv::Point2d> corners;            // [px]; empty: the target is not in view
    std::optional<ViewPicker::Verdict> verdict;  // nothing: it is not in view
    std::string next;  // what to do with the target, for who holds it; empty: enough
  };
  /// Takes what is in the picture, if it adds something.
  Look Offer(std::uint64_t frame, Timestamp time_ns, const cv::Mat& grey);

  const ViewPicker& picker() const { return picker_; }
  const LensTarget& target() const { return *target_; }
  cv::Size picture() const { return picture_; }

  /// The lens, from all views; of a grid of AprilTags after a second look at each picture with the
  /// lens found first. Errors as FitBest.
  absl::StatusOr<LensReport> Fit(const std::string& source, const LensWish& wish);
  /// Another lens from what Fit looked at.
  absl::StatusOr<LensReport> FitAgain(const std::string& source, const LensWish& wish) const;

 private:
  std::unique_ptr<LensTarget> target_;
  cv::Size picture_;
  ViewPicker picker_;
  std::optional<ViewPicker> refined_;  // what Fit looked at
  std::vector<cv::Mat> pictures_;      // of the views, where the target refines
};

}  // namespace saccade
