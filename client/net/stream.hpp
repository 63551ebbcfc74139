#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <variant>
#include <vector>

#include "client/net/connection.hpp"
#include "client/net/scene_types.hpp"
#include "client/net/surface_types.hpp"
#include "client/net/types.hpp"
#include "shared/audio/voice_frame.hpp"
#include "shared/scene/marker_pose.hpp"

namespace saccade::net {

/// When each stage of one frame ended, on the server's monotonic clock [ns]; 0: stage not run.
struct StageStamps {
  Timestamp captured_ns = 0;  // exposure middle
  Timestamp received_ns = 0;
  Timestamp tracked_ns = 0;
  Timestamp encoded_ns = 0;
};

/// A feature as one frame saw it: measured, or searched for in vain where it was expected.
struct SeenFeature {
  FeatureState state = FeatureState::kMeasured;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // raw picture [px]
};
/// Of one frame; what is not in it was not searched for.
using SeenFeatures = std::unordered_map<FeatureId, SeenFeature>;

/// Everything that is known of a frame but its picture. An overlay is drawn from these alone.
struct FrameFacts {
  FrameId frame_id = 0;
  std::shared_ptr<const CameraModel> camera;  // of the picture as coded
  std::optional<MapSnapshot> pose;            // without features
  std::optional<SeenFeatures> features;       // nothing: the server did not say
  std::vector<MarkerPose> markers;            // that move, with things of the scene on them
  StageStamps stages;
  Timestamp arrived_ns = 0;  // MonotonicNow() of this machine
};

/// One access unit, with the facts of its frame.
struct CodedPicture {
  std::shared_ptr<const FrameFacts> facts;
  bool key_frame = false;
  std::string data;  // H.264, Annex B
};

/// What changed in the map. Of a state in parts only the first is `full`: the others add to it.
struct MapChange {
  std::uint64_t generation = 0, revision = 0;
  bool full = false;
  std::vector<FeatureSnapshot> upserted;
  std::vector<FeatureId> removed_ids;
};

/// Where somebody points right now, or what is new of a stroke that they draw.
struct PointerNews {
  std::string participant_id, display_name, stroke_id;
  bool sketch = false;
  std::uint32_t color_rgba = 0xffffffff;
  std::size_t first = 0;                         // place of points_in_world[0] in the stroke
  std::vector<Eigen::Vector3d> points_in_world;  // [m]; of a laser its newest alone
  bool released = false;
};

/// Who is here, and which of them have asked for voice.
struct Presence {
  std::vector<Participant> participants;
  std::vector<std::string> listeners;  // participant ids
};

/// What somebody says. `capture_ns` is of the server's monotonic clock.
struct VoiceNews {
  std::string participant_id;
  std::vector<VoicePacket> packets;
};

using StreamEvent =
    std::variant<MapSnapshot, CodedPicture, MapChange, AnnotationChange, GazeSnapshot, Statistics,
                 Presence, std::vector<PointerNews>, std::vector<ChatMessage>, PicturePause,
                 SceneChange, SurfaceNews, VoiceNews, SourceEnd>;

/// Times of one Ping [ns]: `sent` and `answered` on this machine's clock, the others on the
/// server's.
struct PingTimes {
  Timestamp sent_ns = 0, received_ns = 0, replied_ns = 0, answered_ns = 0;
};

/// Everything that a session is told, pictures among it (raw view).
///
/// Read() blocks one thread; the other calls may come from other threads meanwhile.
class Stream {
 public:
  /// Events in flight unacknowledged; acknowledge every quarter of them.
  static constexpr std::uint32_t kWindow = 32;

  /// `voice`: asks for voices too.
  Stream(const ConnectionOptions& options, std::string session_id, bool voice);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Calls `on_event` for each event with its sequence number (0: nothing to deliver, the number
  /// alone counts), until the server ends the stream (OK or an error, as of Connection) or
  /// Cancel().
  absl::Status Read(const std::function<void(std::uint64_t sequence,
                                             std::optional<StreamEvent> event)>& on_event);
  void Cancel();

  /// Everything up to `sequence` has been taken. `request_key_frame`: the decoder lost its state.
  absl::Status Acknowledge(std::uint64_t sequence, bool request_key_frame);
  absl::StatusOr<PingTimes> Ping();
  /// What was just said here, 1 to 25 packets; DeadlineExceeded after one second.
  absl::Status Speak(const std::vector<VoicePacket>& packets);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::net
