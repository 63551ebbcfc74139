#include "client/cli/recording_commands.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/option_values.hpp"
#include "client/cli/text.hpp"
#include "client/cli/waiting_commands.hpp"

namespace saccade::cli {
namespace {

constexpr std::int64_t kNanosecondsOfASecond = 1'000'000'000;

std::string RecordingText(const net::Recording& recording) {
  if (recording.since_unix_ns == 0 && recording.problem.empty()) return "nothing is recorded\n";
  std::string text = absl::StrFormat("%s%s, %.1f MB since %s\n",
                                     recording.on ? "recording into " : "not recording; last into ",
                                     recording.file, 1e-6 * static_cast<double>(recording.bytes),
                                     TimeText(recording.since_unix_ns / kNanosecondsOfASecond));
  if (recording.events_lost > 0) {
    absl::StrAppend(&text, recording.events_lost, " events were lost: the disk is too slow\n");
  }
  if (!recording.problem.empty()) absl::StrAppend(&text, "stopped: ", recording.problem, "\n");
  return text;
}

}  // namespace

void AddRecording(CLI::App& app, Options& options) {
  CLI::App* recording = app.add_subcommand(
      "recording", "Record on the server, as MCAP: video, poses, map, marks, conversation");
  recording->require_subcommand(1);
  recording->add_subcommand("start", "Begin; whoever watches sees it in the list of people");
  recording->add_subcommand("stop", "End, and say where the file is");
  recording->add_subcommand("status", "How it goes");
  CLI::App* playback = app.add_subcommand(
      "playback", "Of a server that plays a recording (--source replay:FILE), for all who watch");
  playback->require_subcommand(1);
  playback->add_subcommand("status", "Where it is");
  playback->add_subcommand("play", "Go on; from the end: from the beginning");
  playback->add_subcommand("pause", "Stand still");
  playback->add_subcommand("seek", "Go to a moment")
      ->add_option("seconds", options.replay.number, "From its beginning")
      ->check(Number(0.0, 1e9))
      ->required();
  playback->add_subcommand("speed", "Faster or slower")
      ->add_option("factor", options.replay.number, "1: as it was")
      ->check(Number(0.1, 16.0))
      ->required();
}

absl::Status RunRecording(const Options& options, net::Connection& connection) {
  const absl::StatusOr<net::Recording> recording =
      options.command == Command::kRecordingStart  ? connection.StartRecording()
      : options.command == Command::kRecordingStop ? connection.StopRecording()
                                                   : connection.GetRecording();
  if (!recording.ok()) return recording.status();
  if (options.json) {
    std::cout << Dump({{"on", recording->on},
                       {"file", recording->file},
                       {"since_unix_ns", absl::StrCat(recording->since_unix_ns)},
                       {"bytes", recording->bytes},
                       {"messages", recording->messages},
                       {"events_lost", recording->events_lost},
                       {"problem", recording->problem}})
              << "\n";
  } else {
    std::cout << RecordingText(*recording);
  }
  return absl::OkStatus();
}

absl::Status RunPlayback(const Options& options, net::Connection& connection) {
  net::ReplayChange change;
  if (options.command == Command::kPlaybackPlay) change.playing = true;
  if (options.command == Command::kPlaybackPause) change.playing = false;
  if (options.command == Command::kPlaybackSeek) change.position_s = options.replay.number;
  if (options.command == Command::kPlaybackSpeed) change.speed = options.replay.number;
  const absl::StatusOr<net::Replay> replay = options.command == Command::kPlaybackStatus
                                                 ? connection.GetReplay()
                                                 : connection.ChangeReplay(change);
  if (!replay.ok()) return replay.status();
  if (options.json) {
    std::cout << Dump({{"file", replay->file},
                       {"playing", replay->playing},
                       {"position_s", replay->position_s},
                       {"length_s", replay->length_s},
                       {"speed", replay->speed}})
              << "\n";
  } else {
    std::cout << absl::StrFormat("%s: %.1f of %.1f s, %s", replay->file, replay->position_s,
                                 replay->length_s, replay->playing ? "playing" : "standing still")
              << (replay->speed == 1.0 ? ""
                                       : absl::StrFormat(", %.2g times as fast", replay->speed))
              << "\n";
  }
  return absl::OkStatus();
}

}  // namespace saccade::cli
