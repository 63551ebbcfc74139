#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "server/capture/frame.hpp"
#include "server/scene/sight.hpp"
#include "server/tracker/carried_squares.hpp"
#include "server/tracker/lens_state.hpp"
#include "shared/scene/keyframe_places.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/scene_light.hpp"

namespace saccade {

struct StoredMap;

/// What a wearable needs of a tracker: a frame in, a snapshot out. One thread at a time. Tests put
/// their own in.
class FrameTracker {
 public:
  virtual ~FrameTracker() = default;
  /// Never null.
  virtual std::shared_ptr<const MapSnapshot> Track(const Frame& frame) = 0;
  /// Throws the map away.
  virtual void Reset() = 0;
  /// What the place can be come back to by, in another run; null: too little of it is known yet.
  virtual std::shared_ptr<const StoredMap> Store() const { return nullptr; }
  /// Throws the map away and looks for this one in the frames that come; where it is not found
  /// within seconds, a new one is begun. Never null.
  ///   FailedPrecondition  it was made with another lens; the message says which
  ///   Unimplemented       a tracker that has no maps to come back to
  virtual absl::Status Resume(std::shared_ptr<const StoredMap> /*map*/) {
    return absl::UnimplementedError("this tracker cannot come back to a map");
  }
  /// Starts a feature at a clicked pixel of a past frame.
  virtual absl::StatusOr<FeatureId> SeedFeature(const Frame& clicked_frame,
                                                const Rigid3& world_from_camera,
                                                const Eigen::Vector2d& pixel, double depth_prior_m,
                                                double depth_sigma_m) = 0;
  /// What stands still in the world, from the next frame on: landmarks behind it are not attempted.
  /// Null: nothing is known of it.
  virtual void SetSight(std::shared_ptr<const Sight> /*sight*/) {}
  /// Squares that move, from the next frame on: none of them is a landmark. Never null.
  virtual void SetCarried(std::shared_ptr<const CarriedSquareList> /*carried*/) {}
  /// Where light comes from, by what the frames so far show of it.
  virtual SceneLight light() const { return {}; }
  /// The lens of the frame tracked last, where it is learnt; null: that of the frames.
  virtual std::shared_ptr<const CameraModel> lens() const { return nullptr; }
  /// Where the map's keyframes are now; the same object while none has moved, come or gone. Null:
  /// there are none, or the tracker has no such map.
  virtual std::shared_ptr<const KeyframePlaces> keyframes() const { return nullptr; }
  /// How far that is; nothing: it is not learnt.
  virtual std::optional<LensState> lens_state() const { return std::nullopt; }
};

}  // namespace saccade
