#include "client/cli/options.hpp"

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>

#include "client/cli/access_commands.hpp"
#include "client/cli/annotate_options.hpp"
#include "client/cli/map_commands.hpp"
#include "client/cli/option_values.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/record_command.hpp"
#include "client/cli/recording_commands.hpp"
#include "client/cli/scene_commands.hpp"
#include "client/cli/talk_commands.hpp"
#include "client/cli/text.hpp"
#include "shared/version/version.hpp"

namespace saccade::cli {
namespace {

void AddMapAndPictures(CLI::App& app, Options& options, RawOptions& raw) {
  app.add_subcommand("status", "What the server is doing now");
  CLI::App* watch =
      app.add_subcommand("watch", "Follow it: a line a second, or each event as JSON");
  watch->add_option("--for", options.watch_s, "End after so many seconds")
      ->check(Number(0.001, 1e9));
  CLI::App* map = app.add_subcommand("map", "The map's features");
  map->add_option("--out", options.out, "Write it to this file as PLY (x y z in metres, colour)");
  CLI::App* snapshot = app.add_subcommand("snapshot", "One picture as PNG");
  snapshot->add_option("--view", raw.view, "raw (as captured) or augmented (marks drawn in)")
      ->check(CLI::IsMember({"raw", "augmented"}))
      ->required();
  snapshot->add_option("--out", options.out, "The file to write")->required();
  snapshot->add_option("--frame", options.frame, "Frame id (kept for 10 s); else the newest")
      ->check(Id());
}

void AddGaze(CLI::App& app, Options& options, RawOptions& raw) {
  CLI::App* fixate = app.add_subcommand(
      "fixate", "Turn the camera to a point and hold it there until interrupted (Ctrl-C)");
  CLI::Option* annotation =
      fixate->add_option("--annotation", raw.annotation, "Id of an annotation");
  CLI::Option* feature =
      fixate->add_option("--feature", raw.feature, "Id of a feature")->check(Id());
  CLI::Option* point =
      fixate->add_option("--point", raw.point, "X,Y,Z in world [m]")
          ->check(Checked([](const std::string& t) { return ParseNumbers(t, 3); }, "X,Y,Z"));
  annotation->excludes(feature)->excludes(point);
  feature->excludes(point);
  fixate->add_flag("--fast", options.fast, "As fast as the mount can, instead of 30 deg/s");
  fixate->add_option("--for", options.gaze_s, "Let go after so many seconds")
      ->check(Number(0.001, 1e9));
  app.add_subcommand("stop", "Stop the camera where it is");
  app.add_subcommand("release", "Let the camera go");
  CLI::App* home = app.add_subcommand("home", "Turn the camera straight ahead");
  home->add_option("--for", options.gaze_s, "Give up after so many seconds (20)")
      ->check(Number(0.001, 1e9));
}

void AddCalibrateMount(CLI::App& app, Options& options) {
  CLI::App* calibrate = app.add_subcommand(
      "calibrate-mount",
      "Turn the head for a minute and find its axes, offsets, encoder signs and delays");
  calibrate->add_option("--out", options.out,
                        "Write the [mount_model] table to this new TOML file; else print it");
}

Command CommandOf(const CLI::App& app) {
  static const std::map<std::string, Command> commands = {
      {"status", Command::kStatus},
      {"watch", Command::kWatch},
      {"map", Command::kMap},
      {"snapshot", Command::kSnapshot},
      {"annotate", Command::kAnnotate},
      {"annotations", Command::kListAnnotations},
      {"list", Command::kListAnnotations},
      {"show", Command::kShowAnnotation},
      {"delete", Command::kDeleteAnnotation},
      {"lock", Command::kLock},
      {"unlock", Command::kUnlock},
      {"tick", Command::kTick},
      {"picture", Command::kPicture},
      {"undo", Command::kUndo},
      {"redo", Command::kRedo},
      {"fixate", Command::kFixate},
      {"stop", Command::kStop},
      {"release", Command::kRelease},
      {"home", Command::kHome},
      {"calibrate-mount", Command::kCalibrateMount},
      {"trust", Command::kTrust},
      {"invite", Command::kInvite},
      {"invites", Command::kInvites},
      {"revoke", Command::kRevoke},
      {"audit", Command::kAudit},
      {"waiting", Command::kWaiting},
      {"admit", Command::kAdmit},
      {"say", Command::kSay},
      {"messages", Command::kMessages},
      {"pause-picture", Command::kPausePicture},
      {"maps list", Command::kMapsList},
      {"maps save", Command::kMapsSave},
      {"maps load", Command::kMapsLoad},
      {"maps delete", Command::kMapsDelete},
      {"maps export", Command::kMapsExport},
      {"maps import", Command::kMapsImport},
      {"replay", Command::kReplay},
      {"recording start", Command::kRecordingStart},
      {"recording stop", Command::kRecordingStop},
      {"recording status", Command::kRecordingStatus},
      {"playback status", Command::kPlaybackStatus},
      {"playback play", Command::kPlaybackPlay},
      {"playback pause", Command::kPlaybackPause},
      {"playback seek", Command::kPlaybackSeek},
      {"playback speed", Command::kPlaybackSpeed},
      {"scene list", Command::kSceneList},
      {"scene add", Command::kSceneAdd},
      {"scene place", Command::kScenePlace},
      {"scene remove", Command::kSceneRemove},
      {"scene register", Command::kSceneRegister},
      {"cameras", Command::kCameras},
      {"record", Command::kRecord},
      {"calibrate-camera", Command::kCalibrateCamera},
      {"print", Command::kPrintMarkers}};
  const CLI::App* chosen = app.get_subcommands().front();
  const std::string& family = chosen->get_name();
  if (family == "scene" || family == "maps" || family == "recording" ||
      family == "playback") {  // their commands are called as others are
    return commands.at(absl::StrCat(family, " ", chosen->get_subcommands().front()->get_name()));
  }
  if (!chosen->get_subcommands().empty()) chosen = chosen->get_subcommands().front();
  return commands.at(chosen->get_name());
}

absl::StatusOr<GazeTarget> GazeOf(const RawOptions& raw) {
  if (!raw.annotation.empty()) return GazeAnnotation{raw.annotation};
  if (raw.feature) return GazeFeature{*raw.feature};
  if (raw.point.empty()) {
    return absl::InvalidArgumentError(
        "fixate needs --annotation ID, --feature ID or --point X,Y,Z");
  }
  const std::vector<double> xyz = *ParseNumbers(raw.point, 3);
  return GazePoint{{xyz[0], xyz[1], xyz[2]}};
}

// Whatever else is wrong with the command line, this is how its writer wants to be told.
bool WantsJson(int argc, const char* const* argv) {
  return std::any_of(argv, argv + argc,
                     [](const char* word) { return std::string(word) == "--json"; });
}

int Usage(bool json, absl::string_view problem) {
  const std::string text = absl::StrCat(problem, "; see saccade --help");
  const std::string line =
      json ? Dump(ProblemJson(absl::StatusCode::kInvalidArgument, text)) : "saccade: " + text;
  std::fprintf(stderr, "%s\n", line.c_str());
  return kBadUsage;
}

}  // namespace

ParseResult ParseCommandLine(int argc, const char* const* argv) {
  const bool json = WantsJson(argc, argv);
  Options options;
  RawOptions raw;
  options.connection.display_name = "saccade";
  CLI::App app("Talks to a Saccade server: what it sees, its map, its annotations.", "saccade");
  app.set_version_flag("--version", std::string("saccade ") + Version());
  app.add_option("--server", options.connection.server, "HOST:PORT of the server's gRPC address")
      ->capture_default_str();
  app.add_option("--timeout", raw.timeout_s, "Seconds to wait for an answer")
      ->check(Number(0.05, 3600.0))
      ->capture_default_str();
  app.add_option("--name", options.connection.display_name,
                 "Your name, as the others see it; each has its own undo")
      ->check(Utf8())
      ->capture_default_str();
  app.add_flag(
      "--json", options.json,
      "Print JSON instead of text: the answer on stdout, an error as "
      "{\"error\": {\"code\", \"message\"}} on stderr; times in ns and integers above 2^53 "
      "are strings");
  app.require_subcommand(1);
  app.fallthrough();
  AddMapAndPictures(app, options, raw);
  AddAnnotate(app, options, raw);
  AddAnnotations(app, options);
  AddGaze(app, options, raw);
  AddCalibrateMount(app, options);
  AddAccess(app, options);
  AddTalk(app, options);
  AddMaps(app, options);
  AddRecording(app, options);
  AddScene(app, options);
  AddMachine(app, options);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return {std::nullopt, app.exit(error)};  // help and version
    if (app.get_subcommands().empty() && app.remaining_size() > 0) {
      return {std::nullopt,
              Usage(json, absl::StrCat("there is no command '", app.remaining()[0], "'"))};
    }
    return {std::nullopt, Usage(json, error.what())};
  }
  options.command = CommandOf(app);
  options.view = raw.view == "raw" ? net::VideoView::kRaw : net::VideoView::kAugmented;
  options.connection.deadline =
      std::chrono::milliseconds(static_cast<std::int64_t>(raw.timeout_s * 1000));
  if (absl::Status valid = options.connection.Validate(); !valid.ok()) {
    return {std::nullopt, Usage(json, valid.message())};
  }
  if (options.command == Command::kFixate) {
    absl::StatusOr<GazeTarget> target = GazeOf(raw);
    if (!target.ok()) return {std::nullopt, Usage(json, target.status().message())};
    options.gaze = *std::move(target);
  }
  if (options.command == Command::kAnnotate) {
    if (absl::Status done = FinishDraft(raw, options.picture, options.draft); !done.ok()) {
      return {std::nullopt, Usage(json, done.message())};
    }
  }
  return {std::move(options), kSuccess};
}

}  // namespace saccade::cli
