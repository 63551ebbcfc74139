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
  /// Of koller: the ids that are on the walls; empty for any. Others are dropped, and with them the
  /// rest of a picture whose mirror image would hold what this one should.
  std::vector<int> ids = {};
};

/// Finds square markers in pictures. Not thread safe: one a thread.
class MarkerDetector {
 public:
  virtual ~MarkerDetector() = default;
  /// All of them, in no order. `picture` is CV_8UC3 (BGR) where colour is needed, else CV_8UC1; one
  /// that is not, or empty, has none.
  virtual std::vector<MarkerSighting> Detect(const cv::Mat& picture) = 0;
  virtual bool needs_color() const { return false; }
  /// Of the last picture: what was nearly a marker. Grey detectors say nothing.
  const std::vector<MarkerDrop>& dropped() const { return dropped_; }

 protected:
  void ClearDropped() { dropped_.clear(); }
  void Drop(MarkerDrop drop) { dropped_.push_back(std::move(drop)); }

 private:
  std::vector<MarkerDrop> dropped_;
};

inline constexpr char kKollerFamily[] = "koller";

/// "apriltag" (libapriltag), "aruco" (OpenCV, which reads AprilTags too) or "koller".
///   InvalidArgument  no such detector, family, or border; says which there are
absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeMarkerDetector(absl::string_view name,
                                                                   const MarkerOptions& options);

/// Markers in `picture`'s mirror image: of a picture in which there is none, this tells one that
/// was mirrored. Koller's squares are none: theirs are codes either way round.
std::size_t CountIfMirrored(MarkerDetector& detector, const cv::Mat& picture);

/// Families by name that `detector` looks for if none is named.
std::vector<std::string> KnownFamilies(absl::string_view detector);

}  // namespace saccade
