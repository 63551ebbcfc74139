#pragma once

#include <optional>
#include <span>
#include <string>

#include "client/session/thing_edits.hpp"
#include "shared/scene/marker_pose.hpp"

namespace saccade::session {

struct Marker {
  std::string family;  // "apriltag36h11"
  std::uint32_t id = 0;
  double side_m = 0;  // of its black border
};

/// Fixes a thing, where it is, to a square marker that moves; or lets it go where it is. The thread
/// that draws.
class MarkerFixing {
 public:
  explicit MarkerFixing(ThingEdits& edits) : edits_(edits) {}

  /// The marker has to be seen within 6 s: else it is taken back, and `done` says so.
  ///   InvalidArgument    no family or side
  ///   DeadlineExceeded   the marker was not seen
  void Fix(const SceneObject& thing, const Marker& marker, const Rigid3& world_from_thing,
           ThingEdits::Done done);
  void LetGo(SceneObject thing, const Rigid3& world_from_thing, ThingEdits::Done done);
  /// To be called with every picture, and at least once a second. `markers`: that it shows.
  void Check(Timestamp now_ns, std::span<const MarkerPose> markers);
  bool waiting() const { return waiting_.has_value(); }

 private:
  struct Waiting {
    SceneObject thing;  // on its marker, its place there not known yet
    Rigid3 world_from_thing;
    Timestamp until_ns = 0;
    ThingEdits::Done done;
  };
  ThingEdits& edits_;
  std::optional<Waiting> waiting_;
};

/// Null: it was not seen.
const MarkerPose* FindMarker(std::span<const MarkerPose> markers, const std::string& family,
                             std::uint32_t id);

}  // namespace saccade::session
