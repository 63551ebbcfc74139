#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "shared/marks/strokes.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Colours of features, fixed by the source (Davison 2003), as the page has them. BGR.
inline const cv::Scalar kMeasuredColor{77, 90, 255};       // red    #ff5a4d
inline const cv::Scalar kFailedColor{255, 163, 77};        // blue   #4da3ff
inline const cv::Scalar kNotAttemptedColor{77, 216, 255};  // yellow #ffd84d
inline const cv::Scalar kFixatedColor{106, 224, 90};       // green  #5ae06a

/// Draws sub-pixel, anti-aliased lines onto a BGR picture, each over a dark halo. Sizes are given
/// for a picture 640 px wide and grow with it.
class Painter {
 public:
  explicit Painter(cv::Mat& picture);

  void Lines(const std::vector<Polyline2>& lines, const cv::Scalar& color, double width_px,
             bool dashed);
  void HaloUnder(const std::vector<Polyline2>& lines, double width_px);
  /// Shape by state, so that colour is not alone: disc measured, cross failed, ring not attempted.
  void Feature(const Eigen::Vector2d& at, FeatureState state, bool fixated);
  /// A disc with a bright middle.
  void Laser(const Eigen::Vector2d& at, const cv::Scalar& color);
  /// One line over a dark rim; its baseline begins at `at`.
  void Text(const Eigen::Vector2d& at, const std::string& text, const cv::Scalar& color);
  void EdgeArrow(const Eigen::Vector2d& tip, const Eigen::Vector2d& direction,
                 const cv::Scalar& color, bool hollow);
  /// Text over a dark band at the bottom, at most two lines of it.
  void Status(const std::string& text, bool warn);

  /// Of the picture to one 640 px wide; at least a half.
  double scale() const { return scale_; }

 private:
  void Polyline(const Polyline2& line, const cv::Scalar& color, double width_px);

  cv::Mat& picture_;
  double scale_;
};

}  // namespace saccade
