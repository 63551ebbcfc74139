#include "client/cli/commands.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "client/cli/access_commands.hpp"
#include "client/cli/map_commands.hpp"
#include "client/cli/recording_commands.hpp"
#include "client/cli/scene_commands.hpp"
#include "client/cli/talk_commands.hpp"
#include "client/cli/text.hpp"
#include "client/cli/waiting_commands.hpp"

namespace saccade::cli {

absl::Status WriteFile(const std::string& path, const std::string& data) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) {
    return absl::UnavailableError(absl::StrCat("cannot write ", path, ": ", std::strerror(errno),
                                               "; name another file with --out"));
  }
  const bool written = std::fwrite(data.data(), 1, data.size(), file) == data.size();
  const int write_error = written ? 0 : errno;
  const bool closed = std::fclose(file) == 0;
  if (written && closed) return absl::OkStatus();
  const int error = written ? errno : write_error;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  return absl::UnavailableError(absl::StrCat("cannot finish ", path, ": ", std::strerror(error),
                                             "; free some space or name another file with --out"));
}

namespace {

std::string StatusText(const net::ServerStatus& status) {
  const MapSnapshot& pose = status.pose;
  std::vector<std::vector<std::string>> rows;
  rows.push_back({"source", absl::StrCat(status.source, status.source_ended ? " (ended)" : "")});
  rows.push_back(
      {"server", absl::StrFormat("%s, up %.0f s", status.server_version, status.uptime_s)});
  rows.push_back(
      {"tracking", absl::StrCat(Word(pose.status), ", quality ", Word(pose.quality),
                                pose.advice.empty() ? "" : absl::StrCat(": ", pose.advice))});
  rows.push_back({"camera", PointText(pose.world_from_camera.translation, pose.metric)});
  rows.push_back({"frame", absl::StrFormat("%d, matched %d of %d", pose.frame_id, pose.matched,
                                           pose.attempted)});
  rows.push_back(
      {"rate", absl::StrFormat("captured %.1f, tracked %.1f, encoded %.1f fps; %.0f kbit/s",
                               status.statistics.captured_fps_hz, status.statistics.tracked_fps_hz,
                               status.statistics.encoded_fps_hz,
                               1e-3 * status.statistics.video_bit_rate_bit_s)});
  rows.push_back(
      {"time", absl::StrFormat("track %.1f ms (p95 %.1f), encode %.1f ms (p95 %.1f)",
                               status.statistics.track_ms_p50, status.statistics.track_ms_p95,
                               status.statistics.encode_ms_p50, status.statistics.encode_ms_p95)});
  rows.push_back({"map", absl::StrFormat("%d features, %s", status.map_features,
                                         pose.metric ? "metric" : "scale unknown")});
  rows.push_back({"annotations", absl::StrCat(status.annotations)});
  std::string people;
  for (const net::Participant& participant : status.participants) {
    absl::StrAppend(&people, people.empty() ? "" : ", ", participant.display_name, " (",
                    Word(participant.role), ")");
  }
  if (status.picture_pause.paused) {
    rows.push_back(
        {"picture", absl::StrCat("paused by ", status.picture_pause.by, " since ",
                                 TimeText(status.picture_pause.since_unix_ns / 1'000'000'000))});
  }
  rows.push_back({"present", people.empty() ? "nobody" : people});
  return Table(rows);
}

std::string MapText(const net::MapState& map) {
  std::vector<std::vector<std::string>> rows = {
      {"id", "state", map.metric ? "point [m]" : "point", "sigma", "matched"}};
  for (const FeatureSnapshot& feature : map.features) {
    const double sigma = std::sqrt(feature.covariance_in_world.diagonal().maxCoeff());
    rows.push_back({absl::StrCat(feature.id), std::string(Word(feature.state)),
                    PointText(feature.point_in_world, false), absl::StrFormat("%.4f", sigma),
                    absl::StrCat(feature.matched_count)});
  }
  return absl::StrFormat("%d features%s at frame %d, generation %d, revision %d, %s\n%s",
                         map.features.size(), map.complete ? "" : " (a part of all)", map.frame_id,
                         map.generation, map.revision, map.metric ? "metric" : "scale unknown",
                         Table(rows));
}

// One line a second.
class WatchPrinter {
 public:
  explicit WatchPrinter(bool as_json) : json_(as_json) {}

  void Print(const net::WatchEvent& event) {
    if (const auto* pose = std::get_if<MapSnapshot>(&event)) pose_ = *pose;
    if (json_) {
      std::cout << Dump(ToJson(event, pose_.metric)) << std::endl;
      return;
    }
    if (const auto* statistics = std::get_if<net::Statistics>(&event)) {
      PrintLine(*statistics);
    } else if (const auto* change = std::get_if<net::AnnotationChange>(&event)) {
      // Anchors move with each frame; what is worth a line is what comes and goes.
      for (const std::string& id : change->removed_ids) std::cout << "removed " << id << std::endl;
    } else if (const auto* end = std::get_if<net::SourceEnd>(&event)) {
      std::cout << "the source ended after " << end->frames << " frames" << std::endl;
    }
  }

 private:
  void PrintLine(const net::Statistics& statistics) {
    std::cout << absl::StrFormat(
                     "frame %d  %s %s  %s  %.1f fps  track %.1f ms  matched %d of %d%s%s",
                     pose_.frame_id, Word(pose_.status), Word(pose_.quality),
                     PointText(pose_.world_from_camera.translation, pose_.metric),
                     statistics.tracked_fps_hz, statistics.track_ms_p50, pose_.matched,
                     pose_.attempted, pose_.advice.empty() ? "" : "  ", pose_.advice)
              << std::endl;
  }

  bool json_;
  MapSnapshot pose_;
};

}  // namespace

absl::Status RunStatus(const Options& options, net::Connection& connection) {
  const absl::StatusOr<net::ServerStatus> status = connection.GetStatus();
  if (!status.ok()) return status.status();
  std::cout << (options.json ? Dump(ToJson(*status), 2) + "\n" : StatusText(*status));
  return absl::OkStatus();
}

absl::Status RunWatch(const Options& options, net::Connection& connection) {
  WatchPrinter printer(options.json);
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * options.watch_s));
  return connection.Watch([&](const net::WatchEvent& event) {
    printer.Print(event);
    return options.watch_s <= 0 || std::chrono::steady_clock::now() < end;
  });
}

absl::Status RunMap(const Options& options, net::Connection& connection) {
  if (options.out.empty()) {
    const absl::StatusOr<net::MapState> map = connection.GetMap();
    if (!map.ok()) return map.status();
    std::cout << (options.json ? Dump(ToJson(*map), 2) + "\n" : MapText(*map));
    return absl::OkStatus();
  }
  const absl::StatusOr<net::MapExport> exported = connection.ExportMap();
  if (!exported.ok()) return exported.status();
  if (absl::Status written = WriteFile(options.out, exported->data); !written.ok()) return written;
  if (options.json) {
    std::cout << Dump({{"out", options.out}, {"features", exported->feature_count}}) << "\n";
  } else {
    std::cout << absl::StrFormat("%s: %d features\n", options.out, exported->feature_count);
  }
  return absl::OkStatus();
}

absl::Status RunSnapshot(const Options& options, net::Connection& connection) {
  const absl::StatusOr<net::Still> still = connection.GetFrame(options.frame, options.view);
  if (!still.ok()) return still.status();
  if (absl::Status written = WriteFile(options.out, still->png); !written.ok()) return written;
  if (options.json) {
    const nlohmann::json pose = ToJson(still->pose);
    std::cout << Dump({{"out", options.out},
                       {"frame_id", pose["frame_id"]},
                       {"width_px", still->intrinsics.width},
                       {"height_px", still->intrinsics.height},
                       {"pose", pose}})
              << "\n";
  } else {
    std::cout << absl::StrFormat("%s: frame %d, %d x %d, %s\n", options.out, still->frame_id,
                                 still->intrinsics.width, still->intrinsics.height,
                                 Word(still->pose.status));
  }
  return absl::OkStatus();
}

absl::Status Run(const Options& options, net::Connection& connection) {
  switch (options.command) {
    case Command::kStatus:
      return RunStatus(options, connection);
    case Command::kWatch:
      return RunWatch(options, connection);
    case Command::kMap:
      return RunMap(options, connection);
    case Command::kSnapshot:
      return RunSnapshot(options, connection);
    case Command::kAnnotate:
      return RunAnnotate(options, connection);
    case Command::kListAnnotations:
    case Command::kShowAnnotation:
    case Command::kDeleteAnnotation:
    case Command::kLock:
    case Command::kUnlock:
    case Command::kTick:
    case Command::kPicture:
    case Command::kUndo:
    case Command::kRedo:
      return RunAnnotations(options, connection);
    case Command::kFixate:
    case Command::kStop:
    case Command::kRelease:
    case Command::kHome:
      return RunGaze(options, connection);
    case Command::kCalibrateMount:
      return RunCalibrateMount(options, connection);
    case Command::kTrust:
    case Command::kInvite:
    case Command::kInvites:
    case Command::kRevoke:
    case Command::kAudit:
    case Command::kWaiting:
    case Command::kAdmit:
      return RunAccess(options);
    case Command::kSay:
    case Command::kMessages:
    case Command::kPausePicture:
      return RunTalk(options);
    case Command::kPlaybackStatus:
    case Command::kPlaybackPlay:
    case Command::kPlaybackPause:
    case Command::kPlaybackSeek:
    case Command::kPlaybackSpeed:
      return RunPlayback(options, connection);
    case Command::kRecordingStart:
    case Command::kRecordingStop:
    case Command::kRecordingStatus:
      return RunRecording(options, connection);
    case Command::kMapsList:
    case Command::kMapsSave:
    case Command::kMapsLoad:
    case Command::kMapsDelete:
    case Command::kMapsExport:
    case Command::kMapsImport:
      return RunMaps(options, connection);
    case Command::kSceneList:
    case Command::kSceneAdd:
    case Command::kScenePlace:
    case Command::kSceneRemove:
    case Command::kSceneRegister:
      return RunScene(options);
    case Command::kCameras:
    case Command::kRecord:
    case Command::kCalibrateCamera:
    case Command::kReplay:
    case Command::kPrintMarkers:
      break;  // asks no server
  }
  return absl::InternalError("unknown command");
}

}  // namespace saccade::cli
