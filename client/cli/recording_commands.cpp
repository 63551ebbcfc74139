#include "client/cli/recording_commands.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

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

void AddRecording(CLI::App& app, Options& /*options*/) {
  CLI::App* recording = app.add_subcommand(
      "recording", "Record on the server, as MCAP: video, poses, map, marks, conversation");
  recording->require_subcommand(1);
  recording->add_subcommand("start", "Begin; whoever watches sees it in the list of people");
  recording->add_subcommand("stop", "End, and say where the file is");
  recording->add_subcommand("status", "How it goes");
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

}  // namespace saccade::cli
