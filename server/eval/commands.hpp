#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace saccade {

/// `--config` and `--set`, in this order: a later one wins.
struct TrackerArguments {
  std::filesystem::path config;
  std::vector<std::string> set;  // key=value
};

struct RunArguments {
  std::filesystem::path dataset, out;
  TrackerArguments tracker;
  std::string frames;             // A:B, empty for all
  std::vector<std::string> drop;  // A:B each
  std::uint64_t every = 1;
  std::string freeze;   // K:SECONDS, empty for none
  double fps = 0;       // of pictures without time stamps; 0: not given
  double view_deg = 0;  // 0: as camera.yaml says
  bool json = false;
};
struct RestartArguments {
  std::filesystem::path dataset, out;
  std::string source;     // sim:..., instead of a data set
  std::string elsewhere;  // sim:..., that the second run sees instead
  std::uint64_t seed = 1;
  TrackerArguments tracker;
};
struct ScoreArguments {
  std::filesystem::path estimate, truth;
  std::string align = "se3";
};
struct SimArguments {
  std::string scenario;
  int runs = 1;
  std::uint64_t seed = 1;
  std::filesystem::path out;
  double duration_s = 0;  // 0: the scenario's own
  TrackerArguments tracker;
  std::vector<std::filesystem::path> foreign;  // recordings of other places, for `reloc`
  bool targetless = false;                     // the tracker is not told of the chessboard
  bool json = false;
};
struct RenderArguments {
  std::string source, frames;  // sim:desk?..., A:B
  std::filesystem::path out;
  std::filesystem::path camera;  // record: instead of the source's own camera.yaml
  double seconds = 0;            // record: end after so long; 0: with the source
  bool depth = false;            // render: DIR/000123.depth.png beside each picture
};
struct ReplayArguments {
  std::filesystem::path file, out;
  std::string form;            // tum, ply or glb
  std::optional<double> at_s;  // ply, glb: of the recording; nothing: its end
};
struct CalibrateArguments {
  std::string source, frames;
  std::string target;                  // MakeLensTarget's; or...
  std::string board;                   // ...9x6: inner corners
  double square_m = 0;                 // side of one square
  std::string lens = "brown_conrady";  // or kannala_brandt
  std::string form = "saccade";        // or kalibr, ros, opencv
  std::filesystem::path out;
  double seconds = 0;  // end after so long; 0: with the source, or when nothing is missing
  bool json = false;
};
struct MarkersArguments {
  std::filesystem::path images, out;
  std::string detector;               // apriltag, aruco, koller
  std::vector<std::string> families;  // none: what can hardly be taken for something else
  int border_bits = 0;                // of the code's cells; 0: 1, and for a sheet what reads more
  std::string grid;  // aprilgrid.yaml, or 6x6:0.088:0.3; empty: the folder's own; "none"
  std::string ids;   // of koller, that are on the walls: 0:8; empty for any
  int renders = 0;   // instead of pictures: so many are made, with truth
  std::uint64_t seed = 1;
  int keep = 0;  // of the renders, written as pictures
};
struct PrintMarkersArguments {
  std::string family, ids;  // koller, apriltag36h11, ...; 0:8, 3, 1,4,9
  double side_m = 0;
  std::string paper = "a4";  // or letter
  std::filesystem::path out;
};
struct CalibrateTargetArguments {
  std::filesystem::path images;  // a folder of pictures, or...
  std::string source, frames;    // ...a source, A:B of it
  double seconds = 0;            // of the source; 0: to its end
  std::string target;  // chessboard:9x6:0.04, charuco:7x5:0.04:0.03, aprilgrid:6x6:0.088:0.3
  std::string lens;    // empty: the one that explains more
  std::string form = "saccade";  // or kalibr, ros, opencv
  int border_bits = 0;           // as above
  std::filesystem::path out;
  bool json = false;
};
struct PlacementsArguments {
  std::uint64_t seed = 1;
  int count = 1000;
  std::filesystem::path out;
};
struct PoseGraphArguments {
  std::filesystem::path in, out;
  std::string cost = "chordal";  // or chi2
  double robust_width = 0;       // [sigmas], 0: none
};

/// The subcommands of saccade-eval (architecture section 4). Results go to stdout, errors come
/// back.
absl::Status RunCommand(const RunArguments& arguments);
absl::Status ScoreCommand(const ScoreArguments& arguments);
/// Maps and marks the first half of a recording with its truth, or of a simulation, and looks in
/// another run for map and marks in the second half. Prints and writes report.json: when the map
/// was found, how many marks came back, how far they are from where the first run, had it gone on,
/// draws them [px; m in the camera's frame], and the poses from their truth. `elsewhere`: whether
/// the map was rightly given up.
absl::Status RestartCommand(const RestartArguments& arguments);
absl::Status SimCommand(const SimArguments& arguments);
/// Writes frames of a simulated source as the lens saw them, without noise: DIR/000123.png, and
/// with `depth` DIR/000123.depth.png: along the optic axis, 16 bit, 5000 a metre, 0 where nothing
/// is or it is beyond 13.1 m (the layout of the TUM RGB-D data sets).
absl::Status RenderCommand(const RenderArguments& arguments);
/// Writes a simulated source as a recording in TUM layout, noise and all: rgb/, rgb.txt,
/// camera.yaml and groundtruth.txt. It names no target, so it starts as a recording of a room does.
absl::Status RecordSimulator(const RenderArguments& arguments);
/// Writes any source as a recording in TUM layout (RecordSource), a simulated one with its truth.
absl::Status RecordCommand(const RenderArguments& arguments);
/// Writes what a server has recorded (docs/design/recordings.md) as trajectory.tum, or the map as
/// it was known then as map.ply, into a folder.
absl::Status ReplayCommand(const ReplayArguments& arguments);
/// Finds a camera's lens from a source that shows a target and writes it as camera.yaml, with
/// sigmas; refuses where the views do not determine it.
absl::Status CalibrateCameraCommand(const CalibrateArguments& arguments);
/// Finds square markers in the pictures of a folder; DIR/detections.csv: file, family, id, four
/// corners [px], four variances [px^2].
absl::Status MarkersCommand(const MarkersArguments& arguments);
/// Finds them in renders: DIR/truth.csv, detections.csv, report.json (slam-spec T20, T21).
absl::Status MarkersRenderCommand(const MarkersArguments& arguments);
/// Sheets of markers to be printed: what `saccade markers print` becomes.
absl::Status PrintMarkersCommand(const PrintMarkersArguments& arguments);
/// Finds a lens from the pictures of a folder or a source that show a board or a sheet of tags, and
/// writes it as camera.yaml.
absl::Status CalibrateTargetCommand(const CalibrateTargetArguments& arguments);
/// Places random things in random rooms and judges where they came to rest (T34).
absl::Status PlacementsCommand(const PlacementsArguments& arguments);
/// Holds what hides virtual things against rays cast into the simulated room (T33).
absl::Status OcclusionCommand(const PlacementsArguments& arguments);
/// Remakes figures 6 and 7 of Koller et al. (VRST 1997): eight pictures, JPEG.
absl::Status FiguresCommand(const std::filesystem::path& out);
/// Whether the source is paced by the world, and ends when somebody ends it.
bool IsLive(absl::string_view uri);
/// InvalidArgument with the remedy: `uri` is a phone's, which only a server receives.
absl::Status RefusePhone(absl::string_view uri);
/// Optimises a pose graph in g2o's form and prints its cost before and after.
absl::Status PoseGraphCommand(const PoseGraphArguments& arguments);

/// Scenarios that SimCommand knows, for people: "points, desk, ...".
std::string ScenarioNames();

}  // namespace saccade
