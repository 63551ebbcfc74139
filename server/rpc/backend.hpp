#pragma once

#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>
#include <absl/types/span.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/pipeline/commands.hpp"
#include "server/pipeline/events.hpp"
#include "server/pipeline/gaze_commands.hpp"
#include "server/pipeline/kept_maps.hpp"
#include "server/pipeline/pointers.hpp"
#include "server/pipeline/scene_commands.hpp"
#include "shared/scene/scene_light.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// Facts that do not change while the server runs.
struct ServerFacts {
  std::string version;
  std::string source;                         // URI
  std::shared_ptr<const CameraModel> camera;  // never null
};

/// A picture out of the frame ring with what was known after it.
struct Still {
  std::shared_ptr<const std::string> png;
  TrackedEvent tracked;
};

using ParticipantSet = absl::flat_hash_set<std::string>;

/// What the services need of the rest of the server. Thread safe; nothing blocks.
class Backend : public CommandPort {
 public:
  virtual const ServerFacts& facts() const = 0;
  /// All annotations with every edit that was answered, before the first frame too; never null.
  virtual std::shared_ptr<const AnnotationList> annotations() const = 0;
  /// Never null; mode NO_MOUNT without a mount.
  virtual std::shared_ptr<const GazeSnapshot> gaze() const = 0;
  /// To the gaze thread. On error `done` is not called:
  ///   FailedPrecondition  there is no mount
  ///   ResourceExhausted   too many commands are waiting
  ///   Unavailable         the server is shutting down
  virtual absl::Status SubmitGaze(GazeCommand command) = 0;
  /// Encodes on another thread. `frame_id` absent: newest. Errors go to `done`:
  ///   NotFound           no longer, or not yet, in the ring
  ///   ResourceExhausted  too many stills are being made
  ///   FailedPrecondition the wearer has paused the picture, or had when the frame was taken
  virtual void GetStill(std::optional<FrameId> frame_id, VideoView view, Done<Still> done) = 0;
  /// Where pointers point: PointerPlacer's Locate, and Trace where there is a `surface`.
  virtual absl::StatusOr<std::vector<Eigen::Vector3d>> LocatePointer(
      absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>* surface) = 0;
  /// What is pointed at now, for the augmented view; never null.
  virtual void SetPointers(std::shared_ptr<const PointerList> pointers) = 0;
  /// Reads the file of a picture on another thread. Errors go to `done`:
  ///   InvalidArgument    no PNG or JPEG, too large, damaged; says so after "draft.picture: "
  ///   ResourceExhausted  too many are being read
  virtual void ReadPicture(std::string bytes, Done<PicturePtr> done) = 0;
  /// Who has a stream open, by participant_id; never null.
  virtual void SetPresence(std::shared_ptr<const ParticipantSet> present) = 0;
  /// Whether anybody watches; nothing is coded for nobody.
  virtual void SetVideoDemand(VideoView view, bool wanted) = 0;
  /// The next picture of `view` will be a key frame. Requests are coalesced.
  virtual void RequestKeyFrame(VideoView view) = 0;
  /// Stops pictures for everybody, or lets them go again; answered once it is kept over a restart.
  /// On any error but ResourceExhausted (`done` is told: nothing was done) pictures are stopped.
  virtual void PausePicture(bool paused, std::string by, Done<PicturePause> done) = 0;
  /// Never null.
  virtual std::shared_ptr<const PicturePause> picture_pause() const = 0;
  /// With every change that was answered; never null.
  virtual std::shared_ptr<const Scene> scene() const = 0;
  /// How light falls, as far as it is known.
  virtual SceneLight light() const { return {}; }
  /// Null: none are made.
  virtual std::shared_ptr<const SurfaceSnapshot> surface() const { return nullptr; }
  /// Null: none are kept.
  virtual KeptMaps* maps() { return nullptr; }
  /// To the scene's thread. On error `done` is not called: ResourceExhausted, Unavailable.
  virtual absl::Status SubmitScene(SceneCommand command) = 0;
};

}  // namespace saccade
