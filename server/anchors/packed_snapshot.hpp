#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// A feature at rest, whose covariance in the camera follows from that in the world.
struct RestingFeature {
  FeatureId id = 0;
  std::uint32_t matched_count = 0;
  bool depth_known = false;
  Eigen::Vector3d point_in_world;
  Eigen::Matrix3d covariance_in_world;

  bool operator==(const RestingFeature&) const = default;
};

/// A snapshot that is kept for later, without loss but for rounding (1e-9 of the covariance in the
/// camera of a feature at rest). Most of a large map rests from frame to frame:
/// what rests as it did in the snapshot before is kept once.
class PackedSnapshot {
 public:
  /// `before`: the one packed before this, or null.
  PackedSnapshot(const MapSnapshot& snapshot, const PackedSnapshot* before);
  std::shared_ptr<const MapSnapshot> Unpack() const;
  /// Without what is shared with the one before.
  std::size_t bytes() const;

 private:
  MapSnapshot awake_;  // without the features at rest, which are the last
  std::shared_ptr<const std::vector<RestingFeature>> resting_;
  bool shared_ = false;
};

}  // namespace saccade
