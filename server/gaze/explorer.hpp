#pragma once

#include <deque>
#include <optional>

#include "server/mount/mount_model.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Where to look in idle time: at the part of the map that is least certain, within reach and not
/// looked at just now. One thread.
class Explorer {
 public:
  /// The feature whose surroundings (0.3 m) carry the largest relative uncertainty. Nothing in an
  /// empty map. The choice is remembered: its surroundings come last for the next 6 choices.
  std::optional<Eigen::Vector3d> Choose(const MapSnapshot& map, const Rigid3& world_from_mount,
                                        const MountModel& mount);

 private:
  std::deque<Eigen::Vector3d> recent_;
};

}  // namespace saccade
