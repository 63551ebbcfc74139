#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/gl/gl_context.hpp"
#include "server/sim/lens.hpp"
#include "server/sim/scene_renderer.hpp"
#include "server/sim/sensor.hpp"
#include "server/sim/sim_options.hpp"
#include "server/sim/wearer.hpp"

namespace saccade {

/// Takes pictures of the room: exposure, lens, sensor. Lives on the thread that created it.
class SimCamera {
 public:
  static absl::StatusOr<std::unique_ptr<SimCamera>> Create(const RoomScene& scene,
                                                           const CameraModel& camera,
                                                           const SimOptions& options,
                                                           const Wearer& wearer, GlBackend backend);

  /// Picture `frame`, exposed around frame / fps, CV_8UC3. Depends on the options and `frame`
  /// alone.
  absl::StatusOr<cv::Mat> Take(std::uint64_t frame, bool with_noise);
  /// Depth along the optic axis at camera pixels of the instant picture at `time_s` [m], CV_32FC1,
  /// nearest drawn sample. For tests.
  absl::StatusOr<cv::Mat> Depth(double time_s);

 private:
  SimCamera(const CameraModel& camera, const SimOptions& options, const Wearer& wearer);
  /// Moments to average, so that nothing moves much more than a pixel between two of them.
  int SubExposures(double time_s) const;

  CameraModel camera_;
  SimOptions options_;
  Wearer wearer_;
  Lens lens_;
  Sensor sensor_;
  std::unique_ptr<SceneRenderer> renderer_;
  cv::Mat drawn_, sum_;
};

}  // namespace saccade
