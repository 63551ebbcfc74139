#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/gaze.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/marker_pose.hpp"
#include "shared/scene/scene_light.hpp"
#include "shared/scene/scene_object.hpp"
#include "shared/scene/surface_snapshot.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

using AnnotationList = std::vector<Annotation>;

/// When each stage of one frame ended, MonotonicNow() clock [ns]; 0: not run.
struct StageTimestamps {
  Timestamp captured_ns = 0;  // exposure middle, brought to the monotonic clock
  Timestamp received_ns = 0;  // picture complete in memory
  Timestamp tracked_ns = 0;   // pose published
  Timestamp encoded_ns = 0;   // access unit complete
};

/// What is known after one frame. Immutable; parts are shared.
struct TrackedEvent {
  std::shared_ptr<const MapSnapshot> snapshot;        // never null
  std::shared_ptr<const AnnotationList> annotations;  // never null
  std::shared_ptr<const CameraModel> camera;          // never null
  StageTimestamps stages;
  std::shared_ptr<const std::vector<MarkerPose>> markers;  // that move; null: none was seen
  SceneLight light;
};

enum class VideoView { kRaw, kAugmented };
inline constexpr int kVideoViews = 2;

/// One coded picture with the pose it was taken from.
struct VideoPacket {
  VideoView view = VideoView::kRaw;
  std::uint64_t sequence = 0;  // of this view, rises by one: a gap means a lost reference
  bool key_frame = false;
  int temporal_layer = 0;                   // 0, 1, 2
  std::shared_ptr<const std::string> data;  // one access unit, H.264 Annex B
  int width = 0, height = 0;                // of the picture as coded [px]
  TrackedEvent tracked;                     // of the same frame
};

/// Rates and times of the last seconds.
struct EngineStatistics {
  double captured_fps = 0, tracked_fps = 0, encoded_fps = 0;  // [Hz]
  std::uint64_t frames_dropped = 0;  // not tracked because a newer one was there
  std::uint64_t bad_frames = 0;      // could not be decoded
  double video_bit_rate_bit_s = 0;
  double track_ms_p50 = 0, track_ms_p95 = 0, encode_ms_p50 = 0, encode_ms_p95 = 0;
};

/// Whether the wearer keeps everybody from seeing: no video, stills or snapshots while tracking
/// goes on.
struct PicturePause {
  bool paused = false;
  std::string by;                  // display name of who said so last; empty: nobody yet
  std::int64_t since_unix_ns = 0;  // 0: as the server started
};

/// Who hears of what happens: the gRPC streams here, a message broker on another machine later.
/// Calls come from the engine's threads and must not block.
class EventSink {
 public:
  virtual ~EventSink() = default;
  virtual void OnTracked(const TrackedEvent& event) = 0;
  virtual void OnVideo(const std::shared_ptr<const VideoPacket>& packet) = 0;
  virtual void OnStatistics(const EngineStatistics& statistics) = 0;
  virtual void OnGaze(const std::shared_ptr<const GazeSnapshot>& state) = 0;
  virtual void OnEndOfSource(std::uint64_t frames) = 0;
  /// Once it returns, no picture goes out that was not on its way, until pictures are let go again.
  virtual void OnPicturePause(const std::shared_ptr<const PicturePause>& state) = 0;
  /// After every change of the scene, in order.
  virtual void OnScene(const std::shared_ptr<const Scene>& scene) = 0;
  /// Some of it is new, or all.
  virtual void OnSurface(const std::shared_ptr<const SurfaceSnapshot>& surface) = 0;
};

}  // namespace saccade
