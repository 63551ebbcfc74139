#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/markers/marker.hpp"

namespace saccade {

/// What a detector is to look for.
struct MarkerOptions {
  /// "apriltag36h11", "aruco_4x4_50", ...; empty: what the detector knows that can hardly be taken
  /// for something else (KnownFamilies).
  std::vector<std::string> families;
  /// Width of the black border in cells of the code: Kalibr's AprilGrids have 2.
  int border_bits = 1;
};

/// Finds square markers in grey pictures. Not thread safe: one a thread.
class MarkerDetector {
 public:
  virtual ~MarkerDetector() = default;
  /// All of them, by family and id; a marker that is there twice is there twice. `grey` is CV_8UC1;
  /// one that is not, or empty, has none.
  virtual std::vector<MarkerSighting> Detect(const cv::Mat& grey) = 0;
};

/// "apriltag" (libapriltag) or "aruco" (OpenCV, which reads AprilTags too).
///   InvalidArgument  no such detector, family, or border; says which there are
absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeMarkerDetector(absl::string_view name,
                                                                   const MarkerOptions& options);

/// Families by name that `detector` looks for if none is named.
std::vector<std::string> KnownFamilies(absl::string_view detector);

}  // namespace saccade
