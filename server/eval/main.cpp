#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>

#include "server/eval/commands.hpp"
#include "server/eval/markers/marker_flags.hpp"
#include "server/eval/surface/clicks_command.hpp"
#include "server/eval/surface/surface_command.hpp"
#include "server/eval/team/team_command.hpp"
#include "server/eval/team/team_settings.hpp"
#include "shared/version/version.hpp"

namespace saccade {
namespace {

/// One line on stderr; 1, the exit code of a failure.
int Fail(const absl::Status& status) {
  std::string text(status.message());
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  std::cerr << "saccade-eval: " << text << "\n";
  return 1;
}

/// CLI::Range lets NaN through: no comparison with it holds.
CLI::Validator Finite() {
  return CLI::Validator(
      [](std::string& text) {
        double number = 0;
        return CLI::detail::lexical_cast(text, number) && std::isfinite(number)
                   ? std::string()
                   : absl::StrCat("'", text, "' is not a finite number");
      },
      "");
}

/// CLI11 reads -1 as the largest number there is.
CLI::Validator NotNegative() {
  return CLI::Validator(
      [](std::string& text) {
        return text.find('-') == std::string::npos
                   ? std::string()
                   : absl::StrCat("'", text, "' is not a whole number from 0");
      },
      "");
}

void AddRun(CLI::App& app, RunArguments& arguments) {
  CLI::App* run = app.add_subcommand("run", "Track a recording and score it");
  run->add_option("--dataset", arguments.dataset,
                  "Folder in TUM or EuRoC layout, or of pictures with --fps")
      ->required();
  run->add_option("--fps", arguments.fps, "Pictures a second, where there are no time stamps")
      ->check(CLI::Range(0.1, 1000.0))
      ->check(Finite());
  run->add_option("--fov", arguments.view_deg,
                  "Degrees that the lens is taken to see across, whatever camera.yaml says; it is "
                  "learnt while tracking")
      ->check(CLI::Range(10.0, 150.0))
      ->check(Finite());
  run->add_option("--out", arguments.out, "Folder for trajectory.tum, frames.csv and report.json")
      ->required();
  run->add_option("--config", arguments.tracker.config, "TOML file with tracker options");
  run->add_option("--set", arguments.tracker.set,
                  "One tracker option as key=value; may be repeated")
      ->take_all();
  run->add_option("--frames", arguments.frames, "Half-open range A:B of frames, from zero");
  run->add_option("--drop", arguments.drop,
                  "Half-open range A:B of frames to leave out, as if they had been lost; may be "
                  "repeated")
      ->take_all();
  run->add_option("--every", arguments.every, "Only every Nth of the frames that remain")
      ->check(NotNegative())
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  run->add_option("--freeze", arguments.freeze,
                  "K:SECONDS: from frame K on its picture stands still so long");
  run->add_flag("--json", arguments.json, "Print the report as JSON, not as a table");
}

void AddTeam(CLI::App& app, TeamArguments& arguments) {
  CLI::App* team = app.add_subcommand(
      "team",
      "Many in one filter: robots that see each other, or static cameras and a wand; two "
      "recordings whose maps find each other");
  team->add_option("--dataset", arguments.datasets,
                   "Folder in the form of UTIAS MRCLAM, or with cameras.yaml, detections.csv and "
                   "wand_tags.csv; or twice: two recordings of one place")
      ->take_all();
  team->add_option("--foreign", arguments.foreign_pairs,
                   "Instead: so many pairs of rooms that share posters or furniture; none is to be "
                   "merged")
      ->check(CLI::Range(1, 1000000));
  team->add_option("--seed", arguments.seed, "Seed of --foreign")
      ->check(NotNegative())
      ->capture_default_str();
  team->add_option("--frames", arguments.frames,
                   "Half-open range A:B of frames; twice, for each of two recordings")
      ->take_all();
  team->add_option("--out", arguments.out, "Folder for report.json and the trajectories (TUM)")
      ->required();
  team->add_option("--set", arguments.set, "One option as team.key=value; may be repeated")
      ->take_all();
  team->add_flag("--json", arguments.json, "Print the report as JSON, not as a table");
  team->footer(TeamSettingsHelp());
}

void AddRestart(CLI::App& app, RestartArguments& arguments) {
  CLI::App* restart = app.add_subcommand(
      "restart",
      "Map and mark the first half, come back in another run in the second; prints JSON");
  auto* dataset = restart->add_option("--dataset", arguments.dataset,
                                      "Folder in TUM or EuRoC layout, with groundtruth.txt");
  restart->add_option("--source", arguments.source, "sim:desk?..., instead; 20 s if it has no end")
      ->excludes(dataset);
  restart->add_option("--elsewhere", arguments.elsewhere,
                      "sim:desk?..., that the second run sees instead: its map is another");
  restart->add_option("--seed", arguments.seed, "Of the first run; the second has the next one")
      ->check(NotNegative())
      ->capture_default_str();
  restart->add_option("--out", arguments.out, "Folder for report.json, map and marks")->required();
  restart->add_option("--config", arguments.tracker.config, "TOML file with tracker options");
  restart
      ->add_option("--set", arguments.tracker.set,
                   "One tracker option as key=value; may be repeated")
      ->take_all();
}

void AddScore(CLI::App& app, ScoreArguments& arguments) {
  CLI::App* score = app.add_subcommand("score", "Compare two trajectories; prints JSON");
  score->add_option("--estimate", arguments.estimate, "TUM file")->required();
  score->add_option("--truth", arguments.truth, "TUM file")->required();
  score->add_option("--align", arguments.align, "se3 for metric maps, else sim3")
      ->check(CLI::IsMember({"se3", "sim3"}))
      ->capture_default_str();
}

void AddSim(CLI::App& app, SimArguments& arguments) {
  CLI::App* sim = app.add_subcommand("sim", "Monte-Carlo runs on the simulator");
  sim->add_option("--scenario", arguments.scenario, absl::StrCat("One of ", ScenarioNames()))
      ->required();
  sim->add_option("--runs", arguments.runs, "Number of runs")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  sim->add_option("--seed", arguments.seed, "Seed of the first run; run k takes seed + k")
      ->check(NotNegative())
      ->capture_default_str();
  sim->add_option("--out", arguments.out, "Folder for report.json and one folder for each run")
      ->required();
  sim->add_option("--duration", arguments.duration_s,
                  "Seconds of each run; by default 60, or what the closed-loop scenario asks for")
      ->check(CLI::Range(1.0, 36000.0))
      ->check(Finite());
  sim->add_option("--config", arguments.tracker.config, "TOML file with tracker options");
  sim->add_option("--set", arguments.tracker.set,
                  "One tracker option as key=value; may be repeated")
      ->take_all();
  sim->add_option("--foreign", arguments.foreign,
                  "reloc: recording of another place, where nothing may be recognised; may be "
                  "repeated")
      ->take_all();
  sim->add_flag("--targetless", arguments.targetless,
                "desk, walk and the like: start without the chessboard, in a map without metres");
  sim->add_flag("--json", arguments.json, "Print the report as JSON, not as a table");
}

void AddRender(CLI::App& app, RenderArguments& arguments) {
  CLI::App* render = app.add_subcommand("render", "Write frames of the simulator, without noise");
  render->add_option("--source", arguments.source, "sim:desk[?key=value&...]")->required();
  render->add_option("--frames", arguments.frames, "Half-open range A:B of frames, from zero");
  render->add_option("--out", arguments.out, "Folder for 000000.png ...")->required();
  render->add_flag("--depth", arguments.depth, "Also 000000.depth.png ...: 16 bit, 5000 a metre");
}

void AddRecord(CLI::App& app, RenderArguments& arguments) {
  CLI::App* record = app.add_subcommand(
      "record", "Write a source as a recording; the simulator with ground truth");
  record
      ->add_option("--source", arguments.source,
                   "v4l2:DEVICE, file:VIDEO, rtsp://..., dataset:DIR or sim:desk[?key=value&...]")
      ->required();
  record->add_option("--frames", arguments.frames, "Half-open range A:B of frames, from zero");
  record->add_option("--out", arguments.out, "Folder in TUM layout to write")->required();
  record->add_option("--camera", arguments.camera, "camera.yaml instead of the source's own");
  record->add_option("--for", arguments.seconds, "End after so many seconds; else Ctrl-C does")
      ->check(CLI::Range(0.01, 1e6))
      ->check(Finite());
}

constexpr char kLiveTargets[] =
    "chessboard:9x6:0.025 (inner corners, side of a square in metres), "
    "charuco:7x5:0.04:0.03[:aruco_4x4_50] (squares, sides of a square and of a marker), "
    "aprilgrid:6x6:0.088:0.3 (tags, side of a tag, gap as a share of it), aprilgrid:FILE.yaml or "
    "arucogrid:5x7:0.04:0.01[:aruco_4x4_50] (markers, side of one, gap in metres)";

void AddForm(CLI::App& calibrate, std::string& form) {
  calibrate
      .add_option("--form", form,
                  "Of the file: saccade (camera.yaml), kalibr (camchain.yaml; without k3), ros "
                  "(camera_info) or opencv (FileStorage)")
      ->check(CLI::IsMember({"saccade", "kalibr", "ros", "opencv"}))
      ->capture_default_str();
}

void AddCalibrateCamera(CLI::App& app, CalibrateArguments& arguments) {
  CLI::App* calibrate = app.add_subcommand(
      "calibrate-camera", "Find a camera's lens from a target that is moved before it");
  calibrate
      ->add_option("--source", arguments.source,
                   "v4l2:DEVICE, file:VIDEO, rtsp://..., dataset:DIR or sim:desk[?key=value&...]")
      ->required();
  CLI::Option* target = calibrate->add_option("--target", arguments.target, kLiveTargets);
  CLI::Option* square =
      calibrate->add_option("--square", arguments.square_m, "Side of one square [m]: 0.025");
  calibrate->add_option("--board", arguments.board, "Instead of a target: inner corners, 9x6")
      ->needs(square)
      ->excludes(target);
  calibrate->add_option("--out", arguments.out, "The file to write, a new one")->required();
  AddForm(*calibrate, arguments.form);
  calibrate->add_option("--lens", arguments.lens, "kannala_brandt for fisheyes, else brown_conrady")
      ->check(CLI::IsMember({"brown_conrady", "kannala_brandt"}))
      ->capture_default_str();
  calibrate->add_option("--frames", arguments.frames, "Half-open range A:B of frames, from zero");
  calibrate
      ->add_option("--for", arguments.seconds,
                   "End after so many seconds; else a camera ends when nothing is missing")
      ->check(CLI::Range(0.01, 1e6))
      ->check(Finite());
  calibrate->add_flag("--json", arguments.json, "Print report and progress as JSON");
}

void AddCalibrateTarget(CLI::App& app, CalibrateTargetArguments& arguments) {
  CLI::App* calibrate =
      app.add_subcommand("calibrate", "Find a camera's lens from pictures of a target");
  CLI::Option* images = calibrate->add_option("--images", arguments.images, "Folder of pictures");
  calibrate
      ->add_option("--source", arguments.source,
                   "Instead: v4l2:DEVICE, file:VIDEO, rtsp://..., dataset:DIR or "
                   "sim:desk[?key=value&...]")
      ->excludes(images);
  calibrate->add_option("--frames", arguments.frames,
                        "Half-open range A:B of the source's frames, from zero");
  calibrate->add_option("--for", arguments.seconds, "End the source after so many seconds")
      ->check(CLI::Range(0.01, 1e6))
      ->check(Finite());
  calibrate->add_option("--target", arguments.target,
                        "chessboard:9x6:0.04 (inner corners, side of a square in metres), "
                        "charuco:7x5:0.04:0.03[:aruco_4x4_50] (squares, sides of a square and of a "
                        "marker), aprilgrid:6x6:0.088:0.3, aprilgrid:FILE.yaml, "
                        "arucogrid:5x7:0.04:0.01[:aruco_4x4_50] or walls:FILE.yaml "
                        "(squares of known places on two walls, one view is enough); else the "
                        "folder's aprilgrid.yaml");
  calibrate
      ->add_option("--lens", arguments.lens,
                   "Model; else the one that explains the pictures better")
      ->check(CLI::IsMember({"brown_conrady", "kannala_brandt"}));
  calibrate
      ->add_option("--border-bits", arguments.border_bits,
                   "Width of a tag's black border in cells; else what reads more")
      ->check(CLI::Range(1, 4));
  calibrate->add_option("--out", arguments.out, "The file to write, a new one")->required();
  AddForm(*calibrate, arguments.form);
  calibrate->add_flag("--json", arguments.json, "Print the report as JSON");
}

void AddPlacements(CLI::App& app, PlacementsArguments& arguments) {
  CLI::App* placements = app.add_subcommand(
      "placements", "Push and lower random things in random rooms; judge where they rest");
  placements->add_option("--seed", arguments.seed, "Seed of all rooms and things")
      ->check(NotNegative())
      ->capture_default_str();
  placements->add_option("--count", arguments.count, "Things that come to rest")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  placements->add_option("--out", arguments.out, "Folder for placements.csv and report.json")
      ->required();
}

void AddOcclusion(CLI::App& app, PlacementsArguments& arguments) {
  CLI::App* occlusion = app.add_subcommand(
      "occlusion", "Draw virtual things behind real ones; hold what is seen against cast rays");
  occlusion->add_option("--seed", arguments.seed, "Seed of the room, the wearer and the things")
      ->check(NotNegative())
      ->capture_default_str();
  occlusion->add_option("--count", arguments.count, "Pictures")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  occlusion
      ->add_option("--out", arguments.out, "Folder for occlusion.csv, report.json and pictures")
      ->required();
}

void AddFigures(CLI::App& app, std::filesystem::path& out) {
  CLI::App* figures =
      app.add_subcommand("figures", "Remake figures 6 and 7 of Koller et al. (1997)");
  figures->add_option("--out", out, "Folder for the pictures")->required();
}

void AddReplay(CLI::App& app, ReplayArguments& arguments) {
  CLI::App* replay =
      app.add_subcommand("replay", "What a server has recorded (MCAP), in other forms");
  replay->add_option("file", arguments.file, "Recorded by `saccade recording start`")->required();
  replay
      ->add_option("--export", arguments.form,
                   "tum: the poses; ply: the map; glb: surfaces and marks")
      ->check(CLI::IsMember({"tum", "ply", "glb"}))
      ->required();
  replay->add_option("--out", arguments.out, "Folder for trajectory.tum, map.ply or scene.glb")
      ->required();
  replay->add_option("--at", arguments.at_s, "ply, glb: seconds from its beginning; else its end")
      ->check(Finite());
}

/// SIGINT and SIGTERM end the program at once, whatever it does and whoever started it: a shell
/// starts what is in the background deaf to SIGINT, and a mask of blocked signals is inherited.
void HearSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM}) {
    sigaddset(&signals, number);
    signal(number, SIG_DFL);
  }
  sigprocmask(SIG_UNBLOCK, &signals, nullptr);
}

void AddPoseGraph(CLI::App& app, PoseGraphArguments& arguments) {
  CLI::App* graph = app.add_subcommand("posegraph", "Optimise a pose graph; prints its cost");
  graph->add_option("--in", arguments.in, "g2o file: VERTEX_SE3:QUAT, EDGE_SE3:QUAT, or SE2")
      ->required();
  graph->add_option("--out", arguments.out, "g2o file to write")->required();
  graph
      ->add_option("--cost", arguments.cost,
                   "chordal: SE-Sync's, isotropic; chi2: full information matrices, g2o's")
      ->check(CLI::IsMember({"chordal", "chi2"}))
      ->capture_default_str();
  graph
      ->add_option("--robust", arguments.robust_width,
                   "Width of Cauchy's loss on edges in sigmas; 0: squares")
      ->check(CLI::Range(0.0, 1e6))
      ->check(Finite())
      ->capture_default_str();
}

int Main(int argc, char** argv) {
  HearSignals();
  cv::setNumThreads(1);  // results must not depend on the machine's cores
  CLI::App app("Saccade's evaluation: runs on recordings, scores, simulation", "saccade-eval");
  app.set_version_flag("--version", std::string("saccade-eval ") + Version());
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return absl::StrCat(failed->get_name(), ": ", error.what(), "; see --help\n");
  });
  RunArguments run;
  RestartArguments restart;
  ScoreArguments score;
  SimArguments sim;
  RenderArguments render, record;
  CalibrateArguments calibrate;
  PoseGraphArguments graph;
  MarkersArguments markers;
  PrintMarkersArguments print;
  CalibrateTargetArguments target;
  PlacementsArguments placements, occlusion;
  TeamArguments team;
  occlusion.count = 100;
  AddRun(app, run);
  AddRestart(app, restart);
  AddScore(app, score);
  AddSim(app, sim);
  AddRender(app, render);
  AddRecord(app, record);
  AddCalibrateCamera(app, calibrate);
  AddPoseGraph(app, graph);
  AddMarkers(app, markers);
  AddPrintMarkers(app, print);
  AddCalibrateTarget(app, target);
  AddPlacements(app, placements);
  AddOcclusion(app, occlusion);
  AddTeam(app, team);
  ReplayArguments replay;
  AddReplay(app, replay);
  std::filesystem::path figures;
  AddFigures(app, figures);
  SurfaceArguments surface;
  AddSurface(app, surface);
  ClicksArguments clicks;
  AddClicks(app, clicks);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  absl::Status status;
  if (app.got_subcommand("run")) status = RunCommand(run);
  if (app.got_subcommand("restart")) status = RestartCommand(restart);
  if (app.got_subcommand("score")) status = ScoreCommand(score);
  if (app.got_subcommand("sim")) status = SimCommand(sim);
  if (app.got_subcommand("render")) status = RenderCommand(render);
  if (app.got_subcommand("record")) status = RecordCommand(record);
  if (app.got_subcommand("calibrate-camera")) status = CalibrateCameraCommand(calibrate);
  if (app.got_subcommand("posegraph")) status = PoseGraphCommand(graph);
  if (app.got_subcommand("print-markers")) status = PrintMarkersCommand(print);
  if (app.got_subcommand("markers")) {
    status = markers.renders > 0 ? MarkersRenderCommand(markers) : MarkersCommand(markers);
  }
  if (app.got_subcommand("calibrate")) status = CalibrateTargetCommand(target);
  if (app.got_subcommand("placements")) status = PlacementsCommand(placements);
  if (app.got_subcommand("figures")) status = FiguresCommand(figures);
  if (app.got_subcommand("occlusion")) status = OcclusionCommand(occlusion);
  if (app.got_subcommand("surface")) status = SurfaceCommand(surface);
  if (app.got_subcommand("clicks")) status = ClicksCommand(clicks);
  if (app.got_subcommand("replay")) status = ReplayCommand(replay);
  if (app.got_subcommand("team")) status = TeamCommand(team);
  return status.ok() ? 0 : Fail(status);
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) {
  try {
    return saccade::Main(argc, argv);
  } catch (const std::exception& error) {  // no memory, or a name that is not text meets JSON
    return saccade::Fail(absl::InternalError(error.what()));
  }
}
