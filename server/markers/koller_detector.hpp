#pragma once

#include <utility>
#include <vector>

#include "server/markers/marker_detector.hpp"

namespace saccade {

/// Koller's black squares with red cells (Koller et al., VRST 1997, section 2.1; `koller_code`):
/// puddles of the grey picture, grown in green to their borders, four line fits, the id from red.
/// Needs colour; in a grey picture there is none. An id that is there twice is there not at all.
class KollerDetector : public MarkerDetector {
 public:
  /// `ids` as MarkerOptions's.
  explicit KollerDetector(std::vector<int> ids = {}) : ids_(std::move(ids)) {}

  std::vector<MarkerSighting> Detect(const cv::Mat& picture) override;
  bool needs_color() const override { return true; }

 private:
  void DropStrangers(std::vector<MarkerSighting>& found);

  std::vector<int> ids_;
};

}  // namespace saccade
