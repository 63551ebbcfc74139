#include "server/eval/points_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <numbers>

#include "server/eval/consistency.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/points_tracker.hpp"
#include "server/eval/registration.hpp"
#include "server/eval/run.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/statistics.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

/// One way to run the tracker, with what all runs of it added up to.
struct Variant {
  Variant(const char* run_name, std::size_t steps) : name(run_name), consistency(steps) {}
  const char* name;
  bool known_map = false;  // localisation only (T39)
  bool fej = false;        // Jacobians at first estimates (T40)
  bool adjust = false;     // bundle adjustment beside the filter, as the product runs
  ConsistencyTally consistency;
  Sample ates_m, rotations_deg, features;
  std::uint64_t frames = 0, lost_frames = 0, broken_runs = 0;
};

/// The files of a run hold this variant: what the product does.
constexpr const char* kRecorded = "slam_adjusted";

absl::Status WriteTruth(const PointsWorld& world, const std::filesystem::path& folder) {
  absl::StatusOr<OutputFile> file = OutputFile::Create(folder / "groundtruth.txt");
  if (!file.ok()) return file.status();
  for (std::size_t i = 0; i < world.frames.size(); ++i) {
    file->Write(TumLine(absl::StrFormat("%.9f", static_cast<double>(i) * world.dt_s),
                        world.frames[i].world_from_camera));
  }
  if (const absl::Status status = file->Close(); !status.ok()) return status;
  // Nothing is clicked at feature level; the header keeps the folder's form.
  return WriteFileAtomically(folder / "anchors.csv", "frame,anchor,state,drawn,error_px\n");
}

/// A frame and snapshot as the recorder takes them.
absl::Status Record(const PointsTracker& tracker, const PointsStep& step, std::size_t index,
                    double dt_s, const FrameCost& cost, RunRecorder& recorder) {
  Frame frame;
  frame.id = index;
  frame.capture_time_ns = static_cast<Timestamp>(std::llround(1e9 * dt_s * index));
  MapSnapshot snapshot;
  snapshot.status = TrackingStatus::kTracking;
  snapshot.metric = true;
  snapshot.attempted = snapshot.matched = step.matches;
  snapshot.world_from_camera = tracker.tracker().filter().camera().world_from_camera;
  snapshot.features.resize(tracker.tracker().filter().feature_count());
  const bool lost =
      step.position_error_m > kLostPosition_m || step.rotation_error_rad > kLostRotation_rad;
  return recorder.Add(frame, snapshot, cost,
                      lost ? std::optional(FrameVerdict::kLost) : std::nullopt);
}

absl::Status RunVariant(const PointsWorld& world, const PointsOptions& options,
                        const std::filesystem::path& folder, OutputFile& steps_file,
                        Variant& variant) {
  PointsSetup setup = MakeConsistencySetup(options);
  setup.known_map = variant.known_map;
  setup.tracker.fej = variant.fej;
  setup.tracker.adjust = variant.adjust;
  auto tracker = PointsTracker::Create(world, options, setup, world.frames.front());
  if (!tracker.ok()) return tracker.status();
  absl::StatusOr<RunRecorder> recorder = absl::NotFoundError("not recorded");
  if (absl::string_view(variant.name) == kRecorded) {
    recorder = RunRecorder::Create(folder);
    if (!recorder.ok()) return recorder.status();
  }
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < world.frames.size(); ++i) {
    CostMeter meter;
    const absl::StatusOr<PointsStep> step = tracker->Step(world.frames[i]);
    const FrameCost cost = meter.Read();
    ++variant.frames;
    if (!step.ok()) {
      std::cerr << absl::StrCat(folder.string(), ", ", variant.name, ", frame ", i, ": ",
                                step.status().message(), "; the rest counts as lost\n");
      ++variant.broken_runs;
      variant.lost_frames += world.frames.size() - i;
      variant.frames += world.frames.size() - i - 1;
      break;
    }
    variant.consistency.Add(i, step->nees, step->nis, step->matches);
    const Rigid3& estimate = tracker->tracker().filter().camera().world_from_camera;
    const Rigid3& truth = world.frames[i].world_from_camera;
    pairs.push_back(
        {static_cast<Timestamp>(1e9 * world.dt_s * static_cast<double>(i)), estimate, truth});
    variant.lost_frames += IsLost(estimate, truth) ? 1 : 0;
    steps_file.Write(absl::StrFormat("%d,%s,%.4f,%.4f,%d,%.6f,%.6f\n", i, variant.name, step->nees,
                                     step->nis, step->matches, step->position_error_m,
                                     step->rotation_error_rad * 180 / std::numbers::pi));
    if (!recorder.ok()) continue;
    const absl::Status recorded = Record(*tracker, *step, i, world.dt_s, cost, *recorder);
    if (!recorded.ok()) return recorded;
  }
  const absl::StatusOr<TrajectoryScore> score = Score(pairs, TrajectoryAlignment::kSe3);
  if (score.ok()) {
    variant.ates_m.Add(score->ate_se3_m);
    variant.rotations_deg.Add(score->rotation_se3_deg);
  }
  variant.features.Add(static_cast<double>(tracker->tracker().filter().feature_count()));
  return recorder.ok() ? recorder->Close() : absl::OkStatus();
}

Json VariantReport(const Variant& variant) {
  Json report = variant.consistency.Report();
  report["frames"] = variant.frames;
  report["lost_frames"] = variant.lost_frames;
  report["broken_runs"] = variant.broken_runs;
  report["features_mean"] = variant.features.Mean();
  report["ate_se3_runs_m"] = {{"median", variant.ates_m.Percentile(50)},
                              {"max", variant.ates_m.Max()}};
  report["ate_se3_runs_deg"] = {{"median", variant.rotations_deg.Percentile(50)},
                                {"max", variant.rotations_deg.Max()}};
  return report;
}

/// Mean over the runs of each step, for plots.
std::string StepMeans(const std::vector<Variant>& variants, std::size_t steps) {
  std::string text = "frame";
  for (const Variant& each : variants) {
    absl::StrAppend(&text, ",nees_", each.name, ",nis_per_match_", each.name);
  }
  for (std::size_t i = 0; i < steps; ++i) {
    absl::StrAppend(&text, "\n", i);
    for (const Variant& each : variants) {
      absl::StrAppendFormat(&text, ",%.4f,%.4f", each.consistency.MeanNees(i),
                            each.consistency.MeanNis(i));
    }
  }
  return text + "\n";
}

}  // namespace

absl::StatusOr<Json> RunPointsScenario(const SimArguments& arguments) {
  PointsOptions options;
  options.duration_s = arguments.duration_s;
  const auto steps = static_cast<std::size_t>(std::lround(options.duration_s * options.fps));
  std::vector<Variant> variants = {
      {"known_map", steps}, {"slam_fej", steps}, {"slam", steps}, {kRecorded, steps}};
  variants[0].known_map = variants[1].fej = variants[3].adjust = true;
  Timestamp told = MonotonicNow();
  for (int run = 0; run < arguments.runs; ++run) {
    options.seed = arguments.seed + static_cast<std::uint64_t>(run);
    const std::filesystem::path folder = arguments.out / absl::StrFormat("run-%03d", run);
    if (const absl::Status status = CreateFolder(folder); !status.ok()) return status;
    const PointsWorld world = MakePointsWorld(options);
    if (const absl::Status status = WriteTruth(world, folder); !status.ok()) return status;
    absl::StatusOr<OutputFile> steps_file = OutputFile::Create(folder / "consistency.csv");
    if (!steps_file.ok()) return steps_file.status();
    steps_file->Write("frame,variant,nees,nis,matches,position_error_m,rotation_error_deg\n");
    for (Variant& variant : variants) {
      const absl::Status status = RunVariant(world, options, folder, *steps_file, variant);
      if (!status.ok()) return status;
    }
    if (const absl::Status status = steps_file->Close(); !status.ok()) return status;
    if (Seconds(MonotonicNow() - told) > 10.0) {
      told = MonotonicNow();
      std::cerr << absl::StrFormat("run %d of %d done\n", run + 1, arguments.runs);
    }
  }
  const absl::Status written =
      WriteFileAtomically(arguments.out / "step_means.csv", StepMeans(variants, steps));
  if (!written.ok()) return written;
  Json report;
  report["scenario"] = "points";
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["runs"] = arguments.runs;
  report["points"] = options.points;
  report["noise_px"] = options.noise_px;
  // The fields that every scenario has speak of the recorded variant.
  report["frames"] = variants[3].frames;
  report["lost_frames"] = variants[3].lost_frames;
  for (const Variant& each : variants) report[each.name] = VariantReport(each);
  return report;
}

}  // namespace saccade
