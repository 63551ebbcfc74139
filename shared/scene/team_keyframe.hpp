#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What one wearer tells another of a place in his picture: how it looks, and how far it is if he
/// knows.
struct TeamPoint {
  static constexpr int kScales = 3;

  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // [px, distorted]
  double range = 0.0;  // from the camera, in units of the sender's map; 0: not known
  /// 256 bits of steered BRIEF for the picture shrunk by 1.5^k; of those that `present` names.
  std::array<std::array<std::uint64_t, 4>, kScales> descriptors{};
  std::array<bool, kScales> present{};
};

/// A picture of the sender's map, as words: what others recognise places by. Sent again when more
/// is known of it (`edition` rises) or when his map has moved.
struct TeamKeyframe {
  FrameId frame = 0;              // names it, within one generation of the map
  std::uint32_t edition = 0;      // the newest counts
  Timestamp capture_time_ns = 0;  // of the picture, sender's clock
  Timestamp told_time_ns = 0;     // capture time of the newest picture when this was said
  std::uint64_t generation = 0;   // of the map; another one: all before it means nothing now
  bool metric = false;            // lengths are metres
  CameraIntrinsics camera;
  Rigid3 world_from_camera;  // sender's world
  std::vector<TeamPoint> points;
};

}  // namespace saccade
