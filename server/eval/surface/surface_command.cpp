#include "server/eval/surface/surface_command.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/capture/dataset.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/surface/surface_score.hpp"
#include "server/sim/sim_source.hpp"
#include "server/surface/surface_map.hpp"

namespace saccade {
namespace {

using SurfaceJson = nlohmann::ordered_json;

struct SurfaceSource {
  std::unique_ptr<FrameSource> source;
  SimSource* truth = nullptr;  // of the simulator
};

absl::StatusOr<SurfaceSource> OpenSurfaceSource(const SurfaceArguments& arguments) {
  SurfaceSource opened;
  if (!arguments.dataset.empty()) {
    auto source = OpenDataset(arguments.dataset, SourceOptions());
    if (!source.ok()) return source.status();
    opened.source = *std::move(source);
    return opened;
  }
  absl::string_view rest = arguments.source;
  if (!absl::ConsumePrefix(&rest, "sim:")) {
    return absl::InvalidArgumentError(absl::StrCat("surface: --source '", arguments.source,
                                                   "': give sim:desk?..., or --dataset"));
  }
  auto source = SimSource::OpenUri(rest, {});
  if (!source.ok()) return source.status();
  if (!(*source)->info().frame_count && arguments.seconds <= 0) {
    return absl::InvalidArgumentError("surface: the source has no end; give --seconds");
  }
  opened.truth = source->get();
  opened.source = *std::move(source);
  return opened;
}

/// Frames that were kept, for people to compare with.
using FramesSeen = std::map<FrameId, cv::Mat>;

struct SurfaceRun {
  std::unique_ptr<SurfaceMap> surfaces;
  FramesSeen seen;
  std::uint64_t frames = 0, tracked = 0;
  double seconds = 0;
  bool metric = false;
};

absl::StatusOr<SurfaceRun> RunSurfaces(const SurfaceArguments& arguments, FrameSource& source) {
  absl::StatusOr<std::unique_ptr<Tracker>> tracker = MakeTracker(source.info(), arguments.tracker);
  if (!tracker.ok()) return tracker.status();
  absl::StatusOr<std::unique_ptr<SurfaceMap>> surfaces = SurfaceMap::Create(SurfaceOptions());
  if (!surfaces.ok()) return surfaces.status();
  SurfaceRun run;
  run.surfaces = *std::move(surfaces);
  std::optional<Timestamp> begin;
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    if (!begin) begin = (*frame)->capture_time_ns;
    run.seconds = Seconds((*frame)->capture_time_ns - *begin);
    if (arguments.seconds > 0 && run.seconds > arguments.seconds) break;
    ++run.frames;
    const auto snapshot = (*tracker)->Track(**frame);
    if (snapshot->status != TrackingStatus::kTracking) continue;
    ++run.tracked;
    run.metric = snapshot->metric;
    const auto places = (*tracker)->keyframes();
    if (!places || places->keyframes.empty()) continue;
    if (run.surfaces->Wants((*frame)->id, *places)) {
      Frame seen = **frame;
      if (auto lens = (*tracker)->lens()) seen.camera = std::move(lens);
      run.surfaces->Add(seen, *places);
      run.seen[seen.id] = seen.color.empty() ? seen.grey : seen.color;
    } else if (run.frames % 15 == 0) {
      run.surfaces->SetPlaces(*places);
    }
    while (run.surfaces->Work()) {
    }
  }
  return run;
}

SurfaceJson CostReport(const SurfaceRun& run, const WholeMesh& mesh) {
  const SurfaceCost& cost = run.surfaces->cost();
  const double depths = std::max(1, cost.depths), fused = std::max(1, cost.fused);
  SurfaceJson report;
  report["frames"] = run.frames;
  report["tracked"] = run.tracked;
  report["seconds"] = run.seconds;
  report["metric"] = run.metric;
  report["keyframes"] = cost.keyframes;
  report["depths"] = cost.depths;
  report["fused"] = cost.fused;
  report["known_share"] = cost.known_share / depths;
  report["confirmed_share"] = cost.confirmed_share / fused;
  report["picture_ms"] = cost.picture_ms / std::max(1, cost.keyframes);
  report["depth_ms"] = cost.depth_ms / depths;
  report["confirm_ms"] = cost.confirm_ms / fused;
  report["fuse_ms"] = cost.fuse_ms / fused;
  report["mesh_ms"] = cost.mesh_ms / fused;
  report["cores"] =
      (cost.picture_ms + cost.depth_ms + cost.confirm_ms + cost.fuse_ms + cost.mesh_ms) /
      std::max(1.0, 1e3 * run.seconds);
  report["chunks"] = run.surfaces->chunks().size();
  report["versions"] = run.surfaces->version();
  report["corners"] = mesh.points.size();
  report["triangles"] = mesh.triangles.size();
  report["voxel"] = run.surfaces->voxel();
  report["blocks"] = run.surfaces->blocks();
  report["surface_mb"] = 1e-6 * static_cast<double>(run.surfaces->bytes());
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  report["peak_mb"] = 1e-3 * static_cast<double>(usage.ru_maxrss);
  return report;
}

/// What a keyframe saw, and the mesh from there: in its colours, and by its shape.
absl::Status WriteBeside(const SurfaceArguments& arguments, const SurfaceRun& run,
                         const WholeMesh& mesh) {
  const std::vector<SurfaceMap::KeptView> views = run.surfaces->views();
  for (int k = 0; k < arguments.pictures && !views.empty(); ++k) {
    const SurfaceMap::KeptView& view = views[views.size() * static_cast<std::size_t>(2 * k + 1) /
                                             static_cast<std::size_t>(2 * arguments.pictures)];
    const auto seen = run.seen.find(view.frame);
    if (seen == run.seen.end()) continue;
    Pinhole camera = view.picture->camera;
    const float scale = static_cast<float>(seen->second.cols) / static_cast<float>(camera.width);
    camera.width = seen->second.cols;
    camera.height = seen->second.rows;
    camera.focal_px *= scale;
    camera.cx = (camera.cx + 0.5f) * scale - 0.5f;
    camera.cy = (camera.cy + 0.5f) * scale - 0.5f;
    const MeshView drawn = DrawMesh(mesh, camera, view.world_from_camera);
    cv::Mat picture = seen->second, row;
    if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    cv::hconcat(std::vector<cv::Mat>{picture, drawn.color, drawn.shaded}, row);
    const auto file = arguments.out / absl::StrFormat("view_%06d.png", view.frame);
    if (!cv::imwrite(file.string(), row)) {
      return absl::NotFoundError(
          absl::StrCat("--out ", file.string(), ": cannot be written; is the folder writable?"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

void AddSurface(CLI::App& app, SurfaceArguments& arguments) {
  CLI::App* surface = app.add_subcommand(
      "surface", "Find the surfaces that keyframes show, as a mesh; prints JSON");
  auto* dataset =
      surface->add_option("--dataset", arguments.dataset, "Folder in TUM or EuRoC layout");
  surface->add_option("--source", arguments.source, "sim:desk?..., instead")->excludes(dataset);
  surface->add_option("--seconds", arguments.seconds, "Of the source; else to its end")
      ->check(CLI::Range(0.1, 36000.0));
  surface->add_option("--out", arguments.out, "Folder for mesh.ply, report.json and pictures")
      ->required();
  surface->add_option("--pictures", arguments.pictures, "Of the mesh beside what a keyframe saw")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  surface->add_option("--config", arguments.tracker.config, "TOML file with tracker options");
  surface
      ->add_option("--set", arguments.tracker.set,
                   "One tracker option as key=value; may be repeated")
      ->take_all();
}

absl::Status SurfaceCommand(const SurfaceArguments& arguments) {
  if (arguments.source.empty() && arguments.dataset.empty()) {
    return absl::InvalidArgumentError("surface: give --dataset or --source");
  }
  absl::StatusOr<SurfaceSource> opened = OpenSurfaceSource(arguments);
  if (!opened.ok()) return opened.status();
  if (absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  const absl::StatusOr<SurfaceRun> run = RunSurfaces(arguments, *opened->source);
  if (!run.ok()) return run.status();
  const WholeMesh mesh = JoinChunks(run->surfaces->chunks());
  SurfaceJson report = CostReport(*run, mesh);
  if (opened->truth != nullptr) {
    report.update(ScoreSurface(*opened->truth, *run->surfaces, mesh, run->metric));
  }
  for (const absl::Status& status :
       {WritePly(arguments.out / "mesh.ply", mesh), WriteBeside(arguments, *run, mesh),
        WriteFileAtomically(arguments.out / "report.json", report.dump(2) + "\n")}) {
    if (!status.ok()) return status;
  }
  std::cout << report.dump(2) << "\n";
  return absl::OkStatus();
}

}  // namespace saccade
