#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "server/sim/lens.hpp"
#include "server/sim/picture_effects.hpp"
#include "server/sim/scene_renderer.hpp"
#include "server/sim/sensor.hpp"
#include "server/sim/sim_options.hpp"
#include "server/sim/wearer.hpp"

namespace saccade {

/// Where the camera is against the shoulder during one exposure: poses evenly spread from its begin
/// to its end; empty: the shoulder's own.
struct HeadPath {
  std::vector<Rigid3> shoulder_from_camera;
  /// `share` 0: the exposure's begin, 1: its end.
  Rigid3 At(double share) const;
};

/// Takes pictures of the room: exposure, lens, sensor. Lives on the thread that created it.
class SimCamera {
 public:
  static absl::StatusOr<std::unique_ptr<SimCamera>> Create(const RoomScene& scene,
                                                           const CameraModel& camera,
                                                           const SimOptions& options,
                                                           const Wearer& wearer, GlBackend backend);

  /// Picture `frame`, exposed around frame / fps, CV_8UC3. Depends on the options, `frame` and
  /// `head` alone.
  absl::StatusOr<cv::Mat> Take(std::uint64_t frame, const HeadPath& head, bool with_noise);
  /// Depth along the optic axis at camera pixels of the instant picture at `time_s` [m], CV_32FC1,
  /// nearest drawn sample. For tests.
  absl::StatusOr<cv::Mat> Depth(double time_s, const HeadPath& head);

 private:
  SimCamera(const CameraModel& camera, const SimOptions& options, const Wearer& wearer);
  /// One exposure of the whole picture.
  absl::Status Expose(double time_s, const HeadPath& head, cv::Mat& picture);
  /// The same with a shutter that rolls: each row is exposed as much later as it is read later.
  absl::Status ExposeRows(double time_s, const HeadPath& head, cv::Mat& picture);
  /// Gain of each channel that follows what the room looked like in the second before.
  absl::StatusOr<cv::Vec3d> SceneGain(double time_s, const HeadPath& head);
  /// Mean light of each channel at step `step` of a grid in time.
  absl::StatusOr<cv::Vec3d> LightAt(std::int64_t step, const HeadPath& head);
  /// Moments to average, so that nothing moves much more than a pixel between two of them.
  int SubExposures(double time_s, const HeadPath& head, double span_s, int most) const;

  CameraModel camera_;
  SimOptions options_;
  Wearer wearer_;
  Lens lens_;
  Sensor sensor_;
  PictureEffects effects_;
  std::map<std::int64_t, cv::Vec3d> lights_;  // by step, as LightAt has them
  std::unique_ptr<SceneRenderer> renderer_;
  cv::Mat drawn_, sum_;
};

}  // namespace saccade
