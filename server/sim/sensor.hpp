#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "server/sim/sim_options.hpp"

namespace saccade {

/// What the sensor does to the light: vignetting, gain, shot and read noise.
class Sensor {
 public:
  explicit Sensor(const SimOptions& options);

  /// Gain of frame `frame` over the well exposed picture where it does not follow the scene: drifts
  /// and breathes by some per cent.
  double Gain(std::uint64_t frame) const;
  /// Applies vignetting and the gain of each channel, and noise if `with_noise`, in place; `bgr` is
  /// CV_8UC3. The noise depends on the seed and the frame alone.
  void Apply(std::uint64_t frame, const cv::Vec3d& gain, bool with_noise, cv::Mat& bgr) const;

 private:
  SimOptions options_;
  std::vector<std::uint16_t> vignette_;  // per pixel, 1024 = 1
  std::vector<std::int8_t> normal_;      // standard normal * 32, clipped at 3.9 sigma
};

}  // namespace saccade
