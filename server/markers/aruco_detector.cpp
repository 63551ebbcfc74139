#include "server/markers/aruco_detector.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "server/markers/corner_fit.hpp"

namespace saccade {
namespace {

struct Known {
  const char* name;
  int dictionary;
  bool sparse;
};
constexpr std::array kKnown = {
    Known{"apriltag36h11", cv::aruco::DICT_APRILTAG_36h11, true},
    Known{"apriltag25h9", cv::aruco::DICT_APRILTAG_25h9, true},
    Known{"apriltag16h5", cv::aruco::DICT_APRILTAG_16h5, false},
    Known{"aruco_7x7_250", cv::aruco::DICT_7X7_250, true},
    Known{"aruco_7x7_1000", cv::aruco::DICT_7X7_1000, true},
    Known{"aruco_6x6_250", cv::aruco::DICT_6X6_250, true},
    Known{"aruco_6x6_1000", cv::aruco::DICT_6X6_1000, true},
    Known{"aruco_5x5_250", cv::aruco::DICT_5X5_250, true},
    Known{"aruco_5x5_1000", cv::aruco::DICT_5X5_1000, true},
    Known{"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL, false},
    Known{"aruco_4x4_50", cv::aruco::DICT_4X4_50, false},
    Known{"aruco_4x4_100", cv::aruco::DICT_4X4_100, false},
    Known{"aruco_4x4_250", cv::aruco::DICT_4X4_250, false},
    Known{"aruco_4x4_1000", cv::aruco::DICT_4X4_1000, false},
};
// Of corners that no lines were found for: OpenCV's own are drawn inwards.
constexpr double kKeptVariance_px2 = 0.5 * 0.5;
constexpr double kArucoEnlarged = 2.0;
constexpr int kMostArucoPixels = 3'000'000;

}  // namespace

std::vector<std::string> ArucoFamilyNames() {
  std::vector<std::string> names;
  for (const Known& known : kKnown) names.emplace_back(known.name);
  return names;
}

absl::StatusOr<ArucoFamily> MakeArucoFamily(const std::string& name) {
  for (const Known& known : kKnown) {
    if (name != known.name) continue;
    return ArucoFamily{name, cv::aruco::getPredefinedDictionary(known.dictionary), known.sparse};
  }
  return absl::InvalidArgumentError(absl::StrCat("family: there is no '", name, "'; there are ",
                                                 absl::StrJoin(ArucoFamilyNames(), ", ")));
}

ArucoDetector::ArucoDetector(std::vector<ArucoFamily> families, int border_bits)
    : families_(std::move(families)), parameters_(cv::aruco::DetectorParameters::create()) {
  parameters_->markerBorderBits = border_bits;
  parameters_->adaptiveThreshWinSizeMin = 3;
  parameters_->adaptiveThreshWinSizeMax = 43;
  parameters_->adaptiveThreshWinSizeStep = 8;
  parameters_->minMarkerPerimeterRate = 0.02;
  parameters_->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters_->cornerRefinementWinSize = 3;
}

void ArucoDetector::Look(const cv::Mat& grey, double scale,
                         std::vector<MarkerSighting>& found) const {
  cv::Mat picture = grey;
  if (scale != 1.0) cv::resize(grey, picture, {}, scale, scale, cv::INTER_CUBIC);
  for (const ArucoFamily& family : families_) {
    parameters_->errorCorrectionRate = family.sparse ? 0.6 : 0.0;
    std::vector<int> ids;
    std::vector<std::vector<cv::Point2f>> corners;
    cv::aruco::detectMarkers(picture, family.dictionary, corners, ids, parameters_);
    // AprilTags go round the other way, from another corner.
    const bool april = absl::StartsWith(family.name, "apriltag");
    for (std::size_t k = 0; k < ids.size(); ++k) {
      MarkerSighting sighting;
      sighting.family = family.name;
      sighting.id = ids[k];
      for (int c = 0; c < 4; ++c) {
        const cv::Point2f& at = corners[k][april ? (5 - c) % 4 : c];
        sighting.corners[c] = {(at.x + 0.5) / scale - 0.5, (at.y + 0.5) / scale - 0.5};
      }
      const Eigen::Vector2d middle = Middle(sighting);
      const auto same = [&](const MarkerSighting& other) {
        return (Middle(other) - middle).norm() < 0.5 * ShortestSide(other);
      };
      if (std::none_of(found.begin(), found.end(), same)) found.push_back(std::move(sighting));
    }
  }
}

/// Any square reads as something in a family whose codes are close: beside markers of another, it
/// is not believed.
void ArucoDetector::DropGuesses(std::vector<MarkerSighting>& found) const {
  const auto sparse = [&](const MarkerSighting& sighting) {
    return std::any_of(families_.begin(), families_.end(), [&](const ArucoFamily& family) {
      return family.sparse && family.name == sighting.family;
    });
  };
  if (std::none_of(found.begin(), found.end(), sparse)) return;
  std::erase_if(found, [&](const MarkerSighting& sighting) { return !sparse(sighting); });
}

std::vector<MarkerSighting> ArucoDetector::Detect(const cv::Mat& grey) {
  std::vector<MarkerSighting> found;
  if (grey.empty() || grey.type() != CV_8UC1) return found;
  Look(grey, 1.0, found);
  if (kArucoEnlarged * kArucoEnlarged * grey.cols * grey.rows <= kMostArucoPixels) {
    Look(grey, kArucoEnlarged, found);
  }
  DropGuesses(found);
  for (MarkerSighting& sighting : found) RefineCorners(grey, 0, kKeptVariance_px2, sighting);
  return found;
}

}  // namespace saccade
