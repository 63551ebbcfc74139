#pragma once

#include <memory>
#include <vector>

#include "server/markers/marker_detector.hpp"
#include "server/markers/tag_family.hpp"

struct apriltag_detector;

namespace saccade {

/// libapriltag (Wang and Olson, IROS 2016) at full resolution, once as it is, once smoothed,
/// which finds others where there is noise, and once enlarged, for small ones.
class ApriltagDetector : public MarkerDetector {
 public:
  explicit ApriltagDetector(std::vector<TagFamily> families);
  ~ApriltagDetector() override;

  std::vector<MarkerSighting> Detect(const cv::Mat& grey) override;

 private:
  void Look(const cv::Mat& grey, double scale, std::vector<MarkerSighting>& found);

  std::vector<TagFamily> families_;
  struct Destroy {
    void operator()(apriltag_detector* detector) const;
  };
  std::unique_ptr<apriltag_detector, Destroy> detector_;
};

}  // namespace saccade
