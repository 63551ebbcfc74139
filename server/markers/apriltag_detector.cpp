#include "server/markers/apriltag_detector.hpp"

#include <apriltag/apriltag.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "server/markers/corner_fit.hpp"

namespace saccade {
namespace {

constexpr double kSmoothed_px = 0.8;
// Mean difference of a bit from the threshold: noise decodes as something, but not clearly.
constexpr float kLeastMargin = 5;
// In smaller tags the white cells next to the border draw on lines of our own.
constexpr double kLinesFrom_px = 56;
// Tags of a dozen pixels are found when they are twice as large.
constexpr double kEnlarged = 2.0;
constexpr int kMostEnlargedPixels = 3'000'000;

struct FreeDetections {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};

}  // namespace

void ApriltagDetector::Destroy::operator()(apriltag_detector* detector) const {
  apriltag_detector_destroy(detector);
}

ApriltagDetector::ApriltagDetector(std::vector<TagFamily> families)
    : families_(std::move(families)), detector_(apriltag_detector_create()) {
  for (const TagFamily& family : families_) {
    apriltag_detector_add_family_bits(detector_.get(), family.get(), family.MostCorrected());
  }
  detector_->nthreads = 1;
  detector_->quad_decimate = 1.0F;
  detector_->quad_sigma = 0.0F;  // it would smooth the caller's own picture
  detector_->refine_edges = true;
}

ApriltagDetector::~ApriltagDetector() { apriltag_detector_clear_families(detector_.get()); }

void ApriltagDetector::Look(const cv::Mat& grey, double scale, std::vector<MarkerSighting>& found) {
  image_u8_t image = {grey.cols, grey.rows, static_cast<std::int32_t>(grey.step),
                      const_cast<std::uint8_t*>(grey.ptr<std::uint8_t>())};
  const std::unique_ptr<zarray_t, FreeDetections> detections(
      apriltag_detector_detect(detector_.get(), &image));
  for (int k = 0; k < zarray_size(detections.get()); ++k) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections.get(), k, &detection);
    if (detection->decision_margin < kLeastMargin) continue;
    MarkerSighting sighting;
    const auto family = std::find_if(families_.begin(), families_.end(), [&](const auto& known) {
      return known.get() == detection->family;
    });
    sighting.family = family->name();
    sighting.id = detection->id;
    sighting.corrected_bits = detection->hamming;
    bool inside = true;
    for (int c = 0; c < 4; ++c) {  // its pixels have their centres at halves
      const Eigen::Vector2d corner(detection->p[c][0], detection->p[c][1]);
      sighting.corners[c] = corner / scale - Eigen::Vector2d::Constant(0.5);
      inside = inside && corner.minCoeff() >= 0 && corner.x() < grey.cols && corner.y() < grey.rows;
    }
    if (!inside) continue;
    const auto same = [&](const MarkerSighting& other) {
      return (Middle(other) - Middle(sighting)).norm() < 0.5 * ShortestSide(other);
    };
    if (std::none_of(found.begin(), found.end(), same)) found.push_back(std::move(sighting));
  }
}

std::vector<MarkerSighting> ApriltagDetector::Detect(const cv::Mat& grey) {
  std::vector<MarkerSighting> found;
  if (grey.empty() || grey.type() != CV_8UC1) return found;
  Look(grey, 1.0, found);
  cv::Mat smoothed;
  cv::GaussianBlur(grey, smoothed, {}, kSmoothed_px);
  Look(smoothed, 1.0, found);
  if (kEnlarged * kEnlarged * grey.cols * grey.rows <= kMostEnlargedPixels) {
    cv::Mat enlarged;
    cv::resize(grey, enlarged, {}, kEnlarged, kEnlarged, cv::INTER_CUBIC);
    Look(enlarged, kEnlarged, found);
  }
  for (MarkerSighting& sighting : found) RefineCorners(grey, kLinesFrom_px, 0, sighting);
  return found;
}

}  // namespace saccade
