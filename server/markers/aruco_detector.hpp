#pragma once

#include <opencv2/aruco.hpp>
#include <string>
#include <vector>

#include "server/markers/marker_detector.hpp"

namespace saccade {

/// A dictionary of OpenCV's.
struct ArucoFamily {
  std::string name;
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  bool sparse = false;  // its codes differ in so many bits that errors can be corrected
};

/// Errors as MakeMarkerDetector's.
absl::StatusOr<ArucoFamily> MakeArucoFamily(const std::string& name);
std::vector<std::string> ArucoFamilyNames();

/// OpenCV's aruco module, at the picture's own size and, for small markers, at twice that.
class ArucoDetector : public MarkerDetector {
 public:
  /// The first family that reads a square keeps it.
  ArucoDetector(std::vector<ArucoFamily> families, int border_bits);

  std::vector<MarkerSighting> Detect(const cv::Mat& grey) override;

 private:
  void Look(const cv::Mat& grey, double scale, std::vector<MarkerSighting>& found) const;
  void DropGuesses(std::vector<MarkerSighting>& found) const;

  std::vector<ArucoFamily> families_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
};

}  // namespace saccade
