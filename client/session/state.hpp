#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/net/stream.hpp"
#include "client/session/annotation_book.hpp"
#include "client/session/chat_book.hpp"
#include "client/session/clock.hpp"
#include "client/session/pointer_book.hpp"
#include "client/session/scene_book.hpp"
#include "client/session/surface_book.hpp"

namespace saccade::session {

/// How this client stands with the server.
struct Link {
  enum class Kind { kConnecting, kWaiting, kLive, kReconnecting, kRefused };
  Kind kind = Kind::kConnecting;
  std::string reason;      // reconnecting, refused: why, in words
  Timestamp since_ns = 0;  // reconnecting: MonotonicNow() when it was lost

  bool live() const { return kind == Kind::kLive; }
};

/// True where the pose is an estimate of this frame's own, not the last one before tracking was
/// lost.
inline bool IsPlaced(const std::optional<MapSnapshot>& pose) {
  return pose &&
         (pose->status == TrackingStatus::kTracking || pose->status == TrackingStatus::kCoasting);
}

/// Everything that the stream has told. Owned by the thread that draws, which alone changes it.
class State {
 public:
  /// A session begins: what the last one told stays on the screen, but for what is only live.
  void Begin(const std::string& session_id, const net::Joined& joined);
  void Apply(const net::StreamEvent& event, Timestamp now_ns);

  Link link;
  net::Joined joined;
  std::string session_id;
  std::optional<MapSnapshot> pose;  // the newest
  Timestamp pose_ns = 0;            // when it came
  Timestamp heard_ns = 0;           // when the stream last told something; 0: not yet
  bool source_ended = false;
  std::vector<net::Participant> participants;
  std::vector<std::string> listeners;  // ids of those who have asked for voice
  std::optional<net::Statistics> statistics;
  std::optional<GazeSnapshot> gaze;
  /// The wearer's large pause: nobody is shown a picture. Nothing: pictures are shown. Over a lost
  /// connection as it was last told.
  std::optional<net::PicturePause> pause;
  ChatBook chat;
  PointerBook pointers;
  AnnotationBook annotations;
  SceneBook scene;
  SurfaceBook surface;
  ClockOffset clock;
  // The map; `map_version` rises with every change of it.
  std::map<FeatureId, FeatureSnapshot> features;
  std::uint64_t map_generation = 0, map_revision = 0, map_version = 0;
  /// Where the camera has been in this map, 5 mm apart; `path_version` rises with every change.
  std::vector<Eigen::Vector3d> path;
  std::uint64_t path_version = 0;

  bool metric() const { return pose && pose->metric; }
  /// Forgets pointers of others that nothing was heard of; true if there were any.
  bool Expire(Timestamp now_ns) { return pointers.Expire(now_ns); }
  /// How old everything shown is [ns]; nothing while it is live, and before the first of it.
  std::optional<Timestamp> Age(Timestamp now_ns) const;

 private:
  void Take(const MapSnapshot& pose, Timestamp now_ns);
  void Take(const net::MapChange& change);
};

}  // namespace saccade::session
