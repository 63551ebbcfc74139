#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/gaze.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade::net {

/// What a client tells the server about itself.
enum class Role { kExpert, kWearer, kViewer };

/// raw: as captured; augmented: marks burned in by the server.
enum class VideoView { kRaw, kAugmented };

struct Participant {
  std::string participant_id;
  std::string display_name;
  Role role = Role::kViewer;
};

/// The server's running figures, over about the last second.
struct Statistics {
  double captured_fps_hz = 0, tracked_fps_hz = 0, encoded_fps_hz = 0;
  std::uint64_t frames_dropped = 0;  // by the tracker, because a newer one was there
  std::uint64_t bad_frames = 0;      // could not be decoded
  std::uint64_t events_skipped = 0;  // of this subscriber, because it was slow
  double video_bit_rate_bit_s = 0;
  double track_ms_p50 = 0, track_ms_p95 = 0;
  double encode_ms_p50 = 0, encode_ms_p95 = 0;
};

/// The wearer's large pause. `by` is who said so last; empty: nobody did.
struct PicturePause {
  bool paused = false;
  std::string by;
  std::int64_t since_unix_ns = 0;
};

/// What the server records, or recorded last.
struct Recording {
  bool on = false;
  std::string file;                // on the server's disk; empty: none since its start
  std::int64_t since_unix_ns = 0;  // 0: never
  std::uint64_t bytes = 0, messages = 0, events_lost = 0;
  std::string problem;  // why it stopped by itself; empty: it did not
};

/// Where the replay of a recording is.
struct Replay {
  std::string file;
  bool playing = false;
  double position_s = 0, length_s = 0, speed = 1;
};
/// What is to be different; nothing: stays.
struct ReplayChange {
  std::optional<bool> playing;
  std::optional<double> position_s, speed;
};

/// One line of the conversation.
struct ChatMessage {
  std::uint64_t number = 0;  // from 1, rises while the server runs
  std::string participant_id, display_name, text;
  std::string annotation_id;  // a mark to look at; empty: it carries none
  std::int64_t sent_unix_ns = 0;
};

struct ServerStatus {
  MapSnapshot pose;  // of the newest frame, without features
  Statistics statistics;
  std::vector<Participant> participants;
  std::uint32_t map_features = 0;
  std::uint32_t annotations = 0;
  std::string source;
  std::string server_version;
  double uptime_s = 0;
  bool source_ended = false;
  PicturePause picture_pause;
};

struct MapState {
  std::uint64_t generation = 0;
  std::uint64_t revision = 0;
  FrameId frame_id = 0;
  bool metric = false;
  bool complete = true;  // false: the server sent only a part of it
  std::vector<FeatureSnapshot> features;
};

/// What is known of a map on the server's disk.
struct StoredMapFacts {
  std::string id, name, world;  // no name: kept by the server itself
  std::int64_t saved_unix_s = 0;
  bool metric = false;
  std::uint32_t landmarks = 0, places = 0, width = 0, height = 0;
  std::uint64_t bytes = 0;
};

/// A file of the map, ready to be written.
struct MapExport {
  std::string data;
  std::uint32_t feature_count = 0;
};

/// One picture with the pose it was taken from.
struct Still {
  FrameId frame_id = 0;
  std::string png;
  CameraIntrinsics intrinsics;
  MapSnapshot pose;  // without features
};

/// The live estimate of an annotation that is otherwise as before.
struct AnchorUpdate {
  std::string id;
  Anchor anchor;
};

struct AnnotationChange {
  bool full = false;  // the first of a subscription: everything there is
  std::vector<Annotation> upserted;
  std::vector<std::string> removed_ids;
  std::vector<AnchorUpdate> anchors;
};

/// Whether one may steer the camera.
struct Lease {
  bool granted = false;
  std::string lease_id;              // if granted: renew with it
  std::uint32_t queue_position = 0;  // from 1, if not
  GazePilot pilot;                   // who has it
};

struct SourceEnd {
  std::uint64_t frames = 0;
};

/// A laser pointer or a growing stroke as it is sent: what is new of it, or its end.
struct PointerWord {
  std::string stroke_id;  // UUID of ours
  bool sketch = false;    // a stroke, whose points come in their order; else a laser
  std::vector<AnnotationTarget> targets;  // at most 64
  bool released = false;
  std::uint32_t color_rgba = 0xffffffff;
};

/// What Watch() delivers.
using WatchEvent =
    std::variant<MapSnapshot, AnnotationChange, Statistics, std::vector<Participant>, SourceEnd>;

}  // namespace saccade::net
