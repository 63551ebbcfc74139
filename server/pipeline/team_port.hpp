#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/pipeline/events.hpp"
#include "shared/geometry/similarity3.hpp"
#include "shared/scene/team_keyframe.hpp"

namespace saccade {

/// Where another wearer is, in his own world.
struct TeamPose {
  MapSnapshot pose;  // without features
  CameraIntrinsics camera;
};

/// What one server tells another. Immutable once told; each part may be missing.
struct TeamNews {
  std::string device_id;       // UUID of the sender
  std::string display_name;    // of the wearer or the machine
  Timestamp sent_time_ns = 0;  // sender's monotonic clock
  std::vector<TeamKeyframe> keyframes;
  std::optional<TeamPose> pose;
  std::optional<AnnotationList> marks;  // all of the sender's own
};

/// Another wearer, as this server knows him.
struct TeamMember {
  std::string device_id, display_name;
  bool heard = false;   // lately
  bool merged = false;  // his map is one with the own
  Similarity3 own_from_member;
  double sigma_m = 0, sigma_rad = 0;  // largest axes
  std::uint64_t revision = 0;
  int places = 0;
  std::optional<TeamPose> pose;  // in the own world where merged
  std::size_t keyframes = 0;
};

struct TeamState {
  std::string device_id, display_name;
  std::size_t keyframes = 0;
  std::vector<TeamMember> members;
};

/// A server's part in a team. Thread safe; nothing blocks.
class TeamPort {
 public:
  virtual ~TeamPort() = default;
  virtual const std::string& device_id() const = 0;
  /// Another server's word. What comes faster than it is worked off is dropped, oldest first.
  virtual void Hear(std::shared_ptr<const TeamNews> news) = 0;
  virtual TeamState State() const = 0;

  using Listener = std::function<void(const std::shared_ptr<const TeamNews>&)>;
  /// From now on `listener` is told everything, on the port's thread, all that is known first; it
  /// must not block. The result ends it; once that is destroyed it is not called any more.
  virtual std::shared_ptr<void> Listen(Listener listener) = 0;
};

}  // namespace saccade
