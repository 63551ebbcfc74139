#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/net/scene_types.hpp"
#include "client/net/surface_types.hpp"
#include "client/net/types.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade::net {

struct ConnectionOptions {
  /// host:port of the server's gRPC address.
  std::string server = "127.0.0.1:50051";
  /// How long one call may take. A server on the same machine answers within milliseconds; a PNG
  /// over a slow line does not.
  std::chrono::milliseconds deadline{5000};
  /// Who the others see; at most 60 bytes.
  std::string display_name = "guest";
  Role role = Role::kExpert;
  /// A session joined earlier, to go on with; empty: join when a call first needs one. Secret: who
  /// has it acts as you.
  std::string session_id;
  /// TLS, with `root_pem` for whom to trust; empty: the system's store. False: plain.
  bool tls = false;
  std::string root_pem{};
  /// The name that the certificate must have; empty: `server`'s host.
  std::string tls_name{};
  /// A secret that stands for the person, kept between sessions: 32 to 64 of [A-Za-z0-9_-]; empty:
  /// a new person each time.
  std::string person_key{};
  /// What the server lets in by (AccessClient::Redeem); secret. Empty: none.
  std::string token{};

  absl::Status Validate() const;
};

/// What the server said of a session when it was joined.
struct Joined {
  std::string participant_id;  // what others know this session by
  std::string source;          // for example "sim:desk?motion=sway"
  std::string server_version;
};

/// One server as a client sees it: every call in domain types, checked on arrival.
///
/// Calls block until the answer or the deadline; one thread at a time, Watch() aside. Errors keep
/// the gRPC code and say in words what to do about it:
///   Unavailable         nobody answers at that address
///   DeadlineExceeded    no answer in time
///   Unimplemented       the server is older or newer than this program
///   anything else       as the server said
class Connection {
 public:
  using GazeAnswer = absl::StatusOr<GazeSnapshot>;

  /// Does not touch the network: the first call does.
  static absl::StatusOr<std::unique_ptr<Connection>> Create(const ConnectionOptions& options);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// The session that calls are made in; joins, or joins anew if the server no longer knows it.
  absl::StatusOr<std::string> Session();
  /// Joins whatever was joined before, going on with options.session_id if the server knows it.
  absl::StatusOr<std::string> JoinAnew();
  /// The same without asking the server; empty if no call needed one yet.
  const std::string& session_id() const;
  /// Of that session; empty if it was joined earlier (options.session_id) or not yet.
  const Joined& joined() const;

  absl::StatusOr<ServerStatus> GetStatus();
  /// The newest frame if `frame_id` is nothing.
  absl::StatusOr<Still> GetFrame(std::optional<FrameId> frame_id, VideoView view);

  absl::StatusOr<MapState> GetMap();
  /// ASCII PLY, vertex x y z [m] red green blue sigma_m.
  absl::StatusOr<MapExport> ExportMap();
  /// Returns the new map generation.
  absl::StatusOr<std::uint64_t> ResetMap();
  /// Maps on the server's disk, newest first.
  absl::StatusOr<std::vector<StoredMapFacts>> ListMaps();
  /// The id of a copy of the map as it is now.
  absl::StatusOr<std::string> SaveMap(const std::string& name);
  absl::Status LoadMap(const std::string& id);
  absl::Status DeleteMap(const std::string& id);
  /// The file of a map, as it is to be written; DataLoss: not what the server sent.
  absl::StatusOr<std::string> ExportMapFile(const std::string& id);
  /// Such a file into the server, where it keeps its id.
  absl::StatusOr<StoredMapFacts> ImportMapFile(const std::string& file);

  /// `draft.request_id` is filled in if empty, so that a call made again creates nothing twice.
  /// `edit_group`: edits of one session with the same one, not empty, are undone together.
  absl::StatusOr<Annotation> CreateAnnotation(AnnotationDraft draft,
                                              const std::string& edit_group = "");
  absl::StatusOr<Annotation> UpdateAnnotation(const AnnotationPatch& patch,
                                              const std::string& edit_group = "");
  /// Page by page until there are no more.
  absl::StatusOr<std::vector<Annotation>> ListAnnotations();
  absl::Status DeleteAnnotation(const std::string& id, const std::string& edit_group = "");
  /// Ticks line `index` (from 0) of a check list off, or on again.
  absl::StatusOr<Annotation> TickCheckItem(const std::string& id, std::uint32_t index, bool done);
  /// The file that a picture was made of.
  absl::StatusOr<Picture> GetPicture(const std::string& id);
  /// The GLB file of a model of the scene, `bytes` long.
  absl::StatusOr<std::string> GetModel(const std::string& id, std::uint32_t bytes);
  /// Sends a GLB file; the same one again is the same model.
  absl::StatusOr<ModelFacts> UploadModel(const std::string& name, const std::string& glb);
  /// Adds an object (`id` empty) or replaces it; nothing stops it.
  absl::StatusOr<SceneObject> PutThing(const SceneObject& object);
  absl::Status RemoveThing(const std::string& id);
  /// Lets it go where `object` says, after a push if there is one, lowered until it rests.
  absl::StatusOr<PlacedThing> PlaceThing(const SceneObject& object,
                                         const std::optional<Eigen::Vector3d>& push);
  /// What is newer than `version` of the place's surfaces; `max_bytes`: 4 096 to 524 288.
  absl::StatusOr<SurfacePiece> GetSurface(std::uint64_t edition, std::uint64_t version,
                                          std::uint32_t max_bytes);
  /// Where it lies by these pairs, four at least; it is moved there only with `accept`.
  absl::StatusOr<RegisteredThing> RegisterThing(const std::string& id,
                                                const std::vector<PointPair>& pairs,
                                                bool with_scale, bool accept);
  /// What was undone or redone, in words. Acts on the person's own last change.
  absl::StatusOr<std::string> Undo();
  absl::StatusOr<std::string> Redo();

  /// Shows the others where one points, or a stroke while it grows; never stored.
  absl::Status Point(const PointerWord& word);

  /// Says it once, also if the call is made again. `annotation_id`: a mark to look at; empty: none.
  absl::StatusOr<ChatMessage> Say(const std::string& text, const std::string& annotation_id);
  /// What was said: the last 500, oldest first.
  absl::StatusOr<std::vector<ChatMessage>> Messages();
  /// What is kept and what follows, until `on_message` returns false (OK) or the server ends it.
  absl::Status FollowChat(const std::function<bool(const ChatMessage&)>& on_message);
  /// PermissionDenied: only the wearer does that.
  absl::StatusOr<PicturePause> PausePicture(bool paused);

  absl::StatusOr<Recording> GetRecording();
  /// PermissionDenied: only the wearer does that.
  absl::StatusOr<Recording> StartRecording();
  absl::StatusOr<Recording> StopRecording();

  absl::StatusOr<Replay> GetReplay();
  absl::StatusOr<Replay> ChangeReplay(const ReplayChange& change);

  GazeAnswer GetGaze();
  /// Asks for the lease, or renews it: at least every 200 ms, or it is gone.
  absl::StatusOr<Lease> AcquireLease(const std::string& lease_id);
  absl::Status ReleaseLease();
  /// Need the lease. The answer is the state just after.
  GazeAnswer Fixate(const GazeTarget& target, bool fast);
  GazeAnswer StopFixating();
  GazeAnswer Home();
  GazeAnswer KeepHorizon();
  GazeAnswer Explore();
  GazeAnswer CalibrateMount();
  absl::StatusOr<MountCalibrationReport> GetMountCalibration();

  /// Delivers poses, annotations (put together from their parts), statistics and presence until
  /// `on_event` returns false (OK), the server goes away (an error) or closes the stream (OK).
  /// Acknowledges as it reads, so that what arrives is never older than the acknowledgement window.
  absl::Status Watch(const std::function<bool(const WatchEvent&)>& on_event);

 private:
  class Impl;
  explicit Connection(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A random (version 4) UUID.
std::string RandomUuid();

}  // namespace saccade::net
