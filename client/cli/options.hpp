#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/net/connection.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/gaze.hpp"

namespace saccade::cli {

/// Exit codes (architecture, section 4).
inline constexpr int kSuccess = 0, kFailure = 1, kBadUsage = 2;

enum class Command {
  kStatus,
  kWatch,
  kMap,
  kSnapshot,
  kAnnotate,
  kListAnnotations,
  kShowAnnotation,
  kDeleteAnnotation,
  kLock,
  kUnlock,
  kTick,
  kPicture,
  kUndo,
  kRedo,
  kFixate,
  kStop,
  kRelease,
  kHome,
  kCalibrateMount,
  kTrust,
  kInvite,
  kInvites,
  kRevoke,
  kAudit,
  kWaiting,
  kAdmit,
  kSay,
  kMessages,
  kPausePicture,
  kMapsList,
  kMapsSave,
  kMapsLoad,
  kMapsDelete,
  kMapsExport,
  kMapsImport,
  kReplay,
  kRecordingStart,
  kRecordingStop,
  kRecordingStatus,
  kPlaybackStatus,
  kPlaybackPlay,
  kPlaybackPause,
  kPlaybackSeek,
  kPlaybackSpeed,
  kSceneList,
  kSceneAdd,
  kScenePlace,
  kSceneRemove,
  kSceneRegister,
  kCameras,  // of this machine; asks no server
  kRecord,   // likewise
  kCalibrateCamera,
  kPrintMarkers,
};

/// The command line, parsed and checked.
struct Options {
  Command command = Command::kStatus;
  net::ConnectionOptions connection;
  bool json = false;
  std::string out;                             // map, snapshot, picture ...: file to write
  net::VideoView view = net::VideoView::kRaw;  // snapshot
  std::optional<FrameId> frame;                // snapshot, annotate --pixel; nothing: the newest
  std::string id;          // show, delete, lock, tick ...: UUID or the beginning of one
  std::uint32_t line = 0;  // tick: from 1
  bool untick = false;     // tick: on again
  std::string picture;     // annotate --shape picture: file to read
  double watch_s = 0;      // watch: end after this time; 0: never
  AnnotationDraft draft;   // annotate; frame_id 0 until `frame` is known
  GazeTarget gaze;         // fixate
  bool fast = false;       // fixate: at the mount's own limits
  // How the server is reached; ResolveAccess makes `connection` of it.
  std::string trust;  // PEM file; empty: the system's store
  bool tls = false, plain = false;
  std::string invite;         // link or token to redeem
  std::string id_token_file;  // likewise; "-": standard input
  std::string data_dir;       // of a server on this machine; empty: its default
  std::string from;           // trust: HOST:PORT of its page; empty: data_dir
  bool fingerprint = false;   // trust: that alone
  std::string invite_role;    // invite
  std::string life, label;    // invite: "8h"; for whom
  std::uint32_t most = 1000;  // audit
  std::uint32_t uses = 1;     // invite
  bool waiting_room = false;  // invite: who comes by it waits
  bool undo = false;          // revoke
  bool refuse = false;        // admit: sends them away instead
  std::string text;           // say
  bool follow = false;        // messages
  bool pause = false;         // pause-picture
  double gaze_s = 0;          // fixate, home: end after this time; 0: see --help
  struct Record {
    std::string source, frames, seconds, camera;    // as typed; saccade-eval checks them
    std::string target, board, square, lens, form;  // calibrate-camera
  } record;
  struct Markers {
    std::string family, ids, size, paper;  // print; as typed
  } markers;
  struct {
    std::string file, form, at;  // as typed
    double number = 0;           // playback seek, speed
  } replay;
  std::string map_name, map_file;  // maps save; maps import: file to read
  struct Scene {
    std::string model, shape, material, name, points;  // as typed
    std::string size, at, push, gravity;               // X,Y,Z; empty: not given
    std::optional<double> scale, yaw_deg;
    bool with_scale = false, accept = false;
  } scene;
};

/// `count` finite numbers separated by commas: "319.5,239.5".
absl::StatusOr<std::vector<double>> ParseNumbers(absl::string_view text, std::size_t count);

/// Any even number (at least 4) of finite numbers: "U1,V1,U2,V2,...".
absl::StatusOr<std::vector<Eigen::Vector2d>> ParseStroke(absl::string_view text);

/// Either options, or the code with which the program ends at once: help and version (0), bad usage
/// (2). Whatever there is to say is printed.
struct ParseResult {
  std::optional<Options> options;
  int exit_code = kSuccess;
};
ParseResult ParseCommandLine(int argc, const char* const* argv);

}  // namespace saccade::cli
