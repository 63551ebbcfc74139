#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <opencv2/core.hpp>

#include "server/sim/ray_caster.hpp"
#include "server/sim/sim_camera.hpp"

namespace saccade {

/// A camera held still anywhere in the simulated room of one seed. Lives on the thread that created
/// it.
class StillCamera {
 public:
  static absl::StatusOr<StillCamera> Create(std::uint64_t seed);

  /// Grey picture from `world_from_camera`; its noise is that of frame `number`.
  absl::StatusOr<cv::Mat> Take(const Rigid3& world_from_camera, std::uint64_t number);
  /// Whether somebody could look from there: inside the walls, and room before the lens.
  bool Clear(const Rigid3& world_from_camera) const;
  /// Whether the target, which is the same in every room, is in view.
  bool SeesTarget(const Rigid3& world_from_camera) const;

 private:
  explicit StillCamera(const SimOptions& options);

  SimOptions options_;
  RoomScene scene_;
  std::shared_ptr<const CameraModel> lens_;
  Wearer wearer_;
  std::unique_ptr<RayCaster> caster_;
  std::unique_ptr<SimCamera> camera_;
};

}  // namespace saccade
