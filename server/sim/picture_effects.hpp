#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

#include "server/sim/sim_options.hpp"

namespace saccade {

/// What else stands between the room and a recording: a soft lens, haze, the wearer's own arm, and
/// compression. All in place on CV_8UC3; depends on the options and the arguments alone.
class PictureEffects {
 public:
  explicit PictureEffects(const SimOptions& options);

  /// The arm, as it is `time_s` into the motion; reaches in from below every 6 s or so, for 2.5 s.
  void DrawArm(double time_s, cv::Mat& bgr) const;
  /// Whether the arm covers `pixel` then.
  bool ArmCovers(double time_s, const cv::Point2d& pixel) const;
  /// Blur and haze of the lens.
  void Soften(cv::Mat& bgr) const;
  /// Compression and back; InternalError if the picture cannot be coded.
  absl::Status Compress(cv::Mat& bgr) const;

 private:
  struct Arm {
    cv::Point2d elbow, hand;  // [px]
    double width_px = 0.0;
  };
  /// Nothing in most of the time.
  std::optional<Arm> ArmAt(double time_s) const;

  SimOptions options_;
  cv::Mat sleeve_;  // CV_8UC3: the cloth
};

}  // namespace saccade
