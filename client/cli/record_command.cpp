#include "client/cli/record_command.hpp"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace saccade::cli {
namespace {

/// Words of a command line; those without a value are left out.
void AddGiven(std::vector<std::pair<const char*, std::string>> flags,
              std::vector<std::string>& words) {
  for (const auto& [flag, value] : flags) {
    if (!value.empty()) words.insert(words.end(), {flag, value});
  }
}

/// Becomes saccade-eval, which links sources, with these arguments; returns only if it cannot.
absl::Status BecomeEval(std::vector<std::string> words) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (self.parent_path() / "saccade-eval").string();
  words.insert(words.begin(), "saccade-eval");
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  return absl::NotFoundError(
      absl::StrCat(program, ": cannot be started (", std::strerror(errno),
                   "); it opens sources and draws markers: install it beside saccade"));
}

void AddMarkers(CLI::App& app, Options& options) {
  CLI::App* markers = app.add_subcommand("markers", "Square markers on walls and things");
  markers->require_subcommand(1);
  CLI::App* print = markers->add_subcommand(
      "print", "Draw sheets of markers to be printed, with a ruler to check the printer by");
  print
      ->add_option("--family", options.markers.family,
                   "koller (print in colour), apriltag36h11, aruco_4x4_50, ...")
      ->required();
  print->add_option("--ids", options.markers.ids, "0:8 (0 to 7), 3 or 1,4,9")->required();
  print->add_option("--size-m", options.markers.size, "Side of the black border [m]: 0.16")
      ->required();
  print->add_option("--out", options.out, "A new .pdf; or, of one page, .svg or .png")->required();
  print->add_option("--paper", options.markers.paper, "a4 (the default) or letter");
}

}  // namespace

void AddMachine(CLI::App& app, Options& options) {
  app.add_subcommand("cameras", "The cameras of this machine, with their modes; needs no server");
  CLI::App* record = app.add_subcommand(
      "record", "Write a source as a recording that --source dataset:DIR opens; needs no server");
  record
      ->add_option("--source", options.record.source,
                   "v4l2:DEVICE, file:VIDEO, rtsp://..., dataset:DIR or sim:desk[?...]")
      ->required();
  record->add_option("--out", options.out, "The folder to write")->required();
  record->add_option("--frames", options.record.frames, "Half-open range A:B of frames, from zero");
  record->add_option("--for", options.record.seconds,
                     "End after so many seconds; else Ctrl-C does");
  record->add_option("--camera", options.record.camera, "camera.yaml instead of the source's own");
  CLI::App* calibrate = app.add_subcommand(
      "calibrate-camera",
      "Find a camera's lens from a target that you move before it; needs no server");
  calibrate
      ->add_option("--source", options.record.source,
                   "v4l2:DEVICE, file:VIDEO, rtsp://..., dataset:DIR or sim:desk[?...]")
      ->required();
  CLI::Option* target = calibrate->add_option(
      "--target", options.record.target,
      "chessboard:9x6:0.025, charuco:7x5:0.04:0.03[:FAMILY], aprilgrid:6x6:0.088:0.3, "
      "aprilgrid:FILE.yaml or arucogrid:5x7:0.04:0.01[:FAMILY]");
  CLI::Option* square =
      calibrate->add_option("--square", options.record.square, "Side of one square [m]: 0.025");
  CLI::Option* board = calibrate->add_option("--board", options.record.board,
                                             "Instead of a target: inner corners, 9x6");
  board->needs(square)->excludes(target);
  calibrate->add_option("--form", options.record.form,
                        "Of the file: saccade (the default), kalibr, ros or opencv");
  calibrate->add_option("--out", options.out, "The file to write, a new one")->required();
  calibrate->add_option("--lens", options.record.lens,
                        "brown_conrady (the default), or kannala_brandt for fisheyes");
  calibrate->add_option("--frames", options.record.frames,
                        "Half-open range A:B of frames, from zero");
  calibrate->add_option("--for", options.record.seconds,
                        "End after so many seconds; else a camera ends when nothing is missing");
  CLI::App* replay = app.add_subcommand(
      "replay", "What a server has recorded (MCAP), in other forms; needs no server");
  replay->add_option("file", options.replay.file, "Recorded by `saccade recording start`")
      ->required();
  replay
      ->add_option("--export", options.replay.form,
                   "tum: the poses; ply: the map; glb: surfaces and marks")
      ->required();
  replay->add_option("--out", options.out, "Folder for trajectory.tum, map.ply or scene.glb")
      ->required();
  replay->add_option("--at", options.replay.at,
                     "ply, glb: seconds from its beginning; else its end");
  AddMarkers(app, options);
}

absl::Status RunRecord(const Options& options) {
  std::vector<std::string> words = {"record", "--source", options.record.source, "--out",
                                    options.out};
  AddGiven({{"--frames", options.record.frames},
            {"--for", options.record.seconds},
            {"--camera", options.record.camera}},
           words);
  return BecomeEval(std::move(words));
}

absl::Status RunCalibrateCamera(const Options& options) {
  std::vector<std::string> words = {"calibrate-camera", "--source", options.record.source, "--out",
                                    options.out};
  AddGiven({{"--target", options.record.target},
            {"--board", options.record.board},
            {"--square", options.record.square},
            {"--form", options.record.form},
            {"--lens", options.record.lens},
            {"--frames", options.record.frames},
            {"--for", options.record.seconds}},
           words);
  if (options.json) words.emplace_back("--json");
  return BecomeEval(std::move(words));
}

absl::Status RunReplay(const Options& options) {
  std::vector<std::string> words = {"replay", options.replay.file, "--export", options.replay.form,
                                    "--out",  options.out};
  AddGiven({{"--at", options.replay.at}}, words);
  return BecomeEval(std::move(words));
}

absl::Status RunPrintMarkers(const Options& options) {
  std::vector<std::string> words = {
      "print-markers",     "--family", options.markers.family, "--ids",
      options.markers.ids, "--size-m", options.markers.size,   "--out",
      options.out};
  AddGiven({{"--paper", options.markers.paper}}, words);
  return BecomeEval(std::move(words));
}

}  // namespace saccade::cli
