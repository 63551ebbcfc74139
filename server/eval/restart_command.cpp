// A place that is left and come back to: the first half of a recording is mapped and marked,
// another run finds the map and the marks again in the second.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "server/capture/dataset.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/score.hpp"
#include "server/eval/statistics.hpp"
#include "server/map/stored_map.hpp"
#include "server/sim/sim_source.hpp"
#include "server/store/annotation_store.hpp"
#include "server/store/map_shelf.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kData[] = "data", kKept[] = "kept";  // of the first run, and as it was half-way
constexpr int kMarks = 10;
constexpr double kMarksFrom = 0.6;  // of the first half

/// Frames with what is known of where each was truly taken.
struct Recording {
  std::unique_ptr<FrameSource> source;
  SourceInfo info;  // nobody knows of a target
  std::uint64_t frames = 0;
  std::function<std::optional<Rigid3>(const Frame&)> truth;
};

absl::StatusOr<Recording> OpenSimulated(const RestartArguments& arguments) {
  absl::StatusOr<SimOptions> options = SimOptions::FromUri(arguments.source);
  if (!options.ok()) return options.status();
  if (!options->duration_s) options->duration_s = 20.0;
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::Open(*options);
  if (!source.ok()) return source.status();
  Recording recording;
  recording.frames = static_cast<std::uint64_t>(*options->duration_s * options->fps);
  recording.truth = [sim = source->get()](const Frame& frame) -> std::optional<Rigid3> {
    return sim->WorldFromCamera(frame.id);
  };
  recording.source = *std::move(source);
  return recording;
}

absl::StatusOr<Recording> OpenRecorded(const RestartArguments& arguments) {
  auto source = OpenDataset(arguments.dataset, SourceOptions());
  if (!source.ok()) return source.status();
  const auto file = arguments.dataset / "groundtruth.txt";
  if (!MayExist(file)) {
    return absl::NotFoundError(
        absl::StrCat(file.string(), ": without it nobody knows where the marks belong"));
  }
  absl::StatusOr<Trajectory> truth = LoadTrajectory(file);
  if (!truth.ok()) return truth.status();
  Recording recording;
  recording.source = *std::move(source);
  recording.frames = recording.source->info().frame_count.value_or(0);
  const Timestamp gap_ns = 2 * MedianInterval(*truth);
  recording.truth = [truth = *std::move(truth), gap_ns](const Frame& frame) {
    return PoseAt(truth, frame.capture_time_ns, std::max<Timestamp>(gap_ns, 50'000'000),
                  20'000'000);
  };
  return recording;
}

absl::StatusOr<Recording> Open(const RestartArguments& arguments) {
  if (arguments.source.empty() && arguments.dataset.empty()) {
    return absl::InvalidArgumentError("restart: give --dataset or --source");
  }
  absl::StatusOr<Recording> recording =
      arguments.source.empty() ? OpenRecorded(arguments) : OpenSimulated(arguments);
  if (!recording.ok()) return recording.status();
  recording->info = recording->source->info();
  recording->info.target.reset();
  return recording;
}

absl::StatusOr<std::unique_ptr<Wearable>> WearableIn(const RestartArguments& arguments,
                                                     const Recording& recording, bool again) {
  TrackerArguments setup = arguments.tracker;
  setup.set.push_back(absl::StrCat("seed=", arguments.seed + (again ? 1 : 0)));
  absl::StatusOr<std::unique_ptr<FrameTracker>> tracker = MakeFrameTracker(recording.info, setup);
  if (!tracker.ok()) return tracker.status();
  absl::StatusOr<std::unique_ptr<AnnotationStore>> store =
      AnnotationStore::Open(arguments.out / (again ? kKept : kData));
  if (!store.ok()) return store.status();
  return Wearable::Create(recording.info, *std::move(tracker), AnchorOptions(), *std::move(store));
}

/// Clicks on a feature that this frame measured and whose depth is known, each time another.
void MarkSomething(Wearable& wearable, int number) {
  std::vector<const FeatureSnapshot*> seen;
  const auto snapshot = wearable.newest()->snapshot;
  for (const FeatureSnapshot& feature : snapshot->features) {
    if (feature.depth_known && feature.pixel && feature.state == FeatureState::kMeasured) {
      seen.push_back(&feature);
    }
  }
  if (seen.empty()) return;
  const FeatureSnapshot& chosen = *seen[static_cast<std::size_t>(number) * 7919 % seen.size()];
  AnnotationDraft draft;
  draft.request_id = absl::StrFormat("00000000-0000-4000-8000-%012d", number + 1);
  draft.author = "expert";
  draft.target = PixelTarget{snapshot->frame_id, *chosen.pixel};
  wearable.Execute(CreateAnnotation{
      .editor = "expert", .draft = std::move(draft), .done = [](const auto& /*answer*/) {}});
}

/// Where a frame's camera has the marks that it can draw [m of the map], by their ids.
using DrawnMarks = std::map<std::string, Eigen::Vector3d>;

DrawnMarks Drawn(const Wearable& wearable) {
  DrawnMarks drawn;
  const MapSnapshot& snapshot = *wearable.newest()->snapshot;
  if (snapshot.status != TrackingStatus::kTracking) return drawn;
  const Rigid3 camera_from_world = snapshot.world_from_camera.Inverse();
  for (const Annotation& mark : *wearable.annotations()) {
    if (!mark.anchor.place_known) continue;
    drawn[mark.id] = camera_from_world * mark.anchor.point_in_world;
  }
  return drawn;
}

struct FirstRun {
  Similarity truth_from_world;
  int marks = 0;
  std::map<FrameId, DrawnMarks> later;  // the second half, had it not been interrupted
  double ate_m = 0;
  bool metric = false;
};

/// Map and marks as they are now, on the disk.
absl::Status KeepAll(const RestartArguments& arguments, Wearable& wearable, MapShelf& shelf) {
  if (absl::Status kept = wearable.Flush(std::chrono::seconds(10)); !kept.ok()) return kept;
  wearable.Settle();
  const absl::StatusOr<StoredWorld> stored = wearable.Store();
  if (!stored.ok()) return stored.status();
  KeptMapFacts facts;
  facts.id = facts.world = stored->world;
  facts.saved_unix_s = 1;
  std::error_code error;
  std::filesystem::copy(arguments.out / kData, arguments.out / kKept,
                        std::filesystem::copy_options::recursive, error);
  if (error) return absl::UnavailableError(absl::StrCat("restart: ", error.message()));
  return shelf.Save(facts, *stored->map);
}

absl::StatusOr<FirstRun> MapAndMark(const RestartArguments& arguments, MapShelf& shelf) {
  absl::StatusOr<Recording> recording = Open(arguments);
  if (!recording.ok()) return recording.status();
  absl::StatusOr<std::unique_ptr<Wearable>> wearable =
      WearableIn(arguments, *recording, /*again=*/false);
  if (!wearable.ok()) return wearable.status();
  const std::uint64_t half = recording->frames / 2;
  const auto from = static_cast<std::uint64_t>(kMarksFrom * static_cast<double>(half));
  const std::uint64_t every = std::max<std::uint64_t>(1, (half - from) / (kMarks + 1));
  std::vector<PosePair> pairs;
  int marks = 0;
  FirstRun first;
  for (std::uint64_t k = 0; k < recording->frames; ++k) {
    if (k == half) {
      if (absl::Status kept = KeepAll(arguments, **wearable, shelf); !kept.ok()) return kept;
      if (!arguments.elsewhere.empty()) break;
    }
    auto frame = recording->source->Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    const std::optional<Rigid3> truth = recording->truth(**frame);
    const Timestamp now_ns = (*frame)->capture_time_ns;
    const FrameId id = (*frame)->id;
    const WearableStep& step = (*wearable)->Step(**std::move(frame));
    if (step.snapshot->status != TrackingStatus::kTracking) continue;
    if (k >= half) {
      first.later[id] = Drawn(**wearable);
      continue;
    }
    if (truth) pairs.push_back({now_ns, step.snapshot->world_from_camera, *truth});
    if (k >= from && marks < kMarks && (k - from) % every == 0) {
      MarkSomething(**wearable, marks++);
    }
  }
  if (pairs.size() < 3) {
    return absl::FailedPreconditionError("restart: the first half was not tracked");
  }
  first.metric = (*wearable)->newest()->snapshot->metric;
  const auto alignment = first.metric ? TrajectoryAlignment::kSe3 : TrajectoryAlignment::kSim3;
  std::vector<Eigen::Vector3d> source, target;
  for (const PosePair& pair : pairs) {
    source.push_back(pair.estimate.translation);
    target.push_back(pair.truth.translation);
  }
  first.truth_from_world = AlignPoints(source, target, alignment);
  if (const auto score = Score(pairs, alignment); score.ok()) {
    first.ate_m = first.metric ? score->ate_se3_m : score->ate_sim3_m;
  }
  first.marks = static_cast<int>((*wearable)->annotations()->size());
  return first;
}

struct SecondRun {
  std::optional<double> found_s;  // after its first frame
  std::uint64_t frames = 0, tracked = 0;
  bool another_map = false;  // the stored one was given up
  int back = 0;              // marks whose place was known again
  Sample marks_px, marks_m, pose_m;
};

absl::StatusOr<SecondRun> ComeBack(const RestartArguments& arguments, const FirstRun& first,
                                   MapShelf& shelf) {
  RestartArguments place = arguments;
  if (!arguments.elsewhere.empty()) place.source = arguments.elsewhere;
  absl::StatusOr<Recording> recording = Open(place);
  if (!recording.ok()) return recording.status();
  absl::StatusOr<std::unique_ptr<Wearable>> wearable =
      WearableIn(arguments, *recording, /*again=*/true);
  if (!wearable.ok()) return wearable.status();
  const std::vector<KeptMapFacts> kept = shelf.List();
  if (kept.empty()) return absl::DataLossError("restart: the map that was saved is not there");
  absl::StatusOr<KeptMap> read = shelf.Load(kept.front().id);
  if (!read.ok()) return read.status();
  const StoredWorld stored{std::make_shared<const StoredMap>(std::move(read->map)),
                           read->facts.world};
  if (absl::Status resumed = (*wearable)->Resume(stored); !resumed.ok()) return resumed;
  SecondRun second;
  std::optional<Timestamp> begin_ns;
  std::optional<std::uint64_t> generation;
  std::set<std::string> back;
  for (std::uint64_t k = 0; k < recording->frames; ++k) {
    auto frame = recording->source->Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    if (k < recording->frames / 2) continue;
    const std::optional<Rigid3> truth = recording->truth(**frame);
    const Timestamp now_ns = (*frame)->capture_time_ns;
    if (!begin_ns) begin_ns = now_ns;
    const WearableStep& step = (*wearable)->Step(**std::move(frame));
    if (!generation) generation = step.snapshot->map_generation;
    ++second.frames;
    if (step.snapshot->map_generation != *generation) {
      second.another_map = true;
      break;
    }
    if (step.snapshot->status != TrackingStatus::kTracking) continue;
    ++second.tracked;
    if (!second.found_s) second.found_s = Seconds(now_ns - *begin_ns);
    if (!truth) continue;
    const Rigid3& pose = step.snapshot->world_from_camera;
    second.pose_m.Add((first.truth_from_world * pose.translation - truth->translation).norm());
    const CameraModel& camera = *step.frame->camera;
    const auto uninterrupted = first.later.find(step.frame->id);
    for (const auto& [id, point] : Drawn(**wearable)) {
      back.insert(id);
      if (uninterrupted == first.later.end() || !uninterrupted->second.contains(id)) continue;
      const Eigen::Vector3d& expected = uninterrupted->second.at(id);
      const auto there = camera.Project(expected), here = camera.Project(point);
      if (!there || !here || !camera.InImage(*there)) continue;
      second.marks_px.Add((*here - *there).norm());
      second.marks_m.Add(first.truth_from_world.scale * (point - expected).norm());
    }
  }
  second.back = static_cast<int>(back.size());
  return second;
}

}  // namespace

absl::Status RestartCommand(const RestartArguments& arguments) {
  std::error_code error;
  std::filesystem::remove_all(arguments.out / kData, error);
  std::filesystem::remove_all(arguments.out / kKept, error);
  std::filesystem::create_directories(arguments.out, error);
  MapShelf shelf(arguments.out / kKept / "maps");
  const absl::StatusOr<FirstRun> first = MapAndMark(arguments, shelf);
  if (!first.ok()) return first.status();
  const absl::StatusOr<SecondRun> second = ComeBack(arguments, *first, shelf);
  if (!second.ok()) return second.status();
  const std::vector<KeptMapFacts> kept = shelf.List();
  Json report;
  report["map_bytes"] = kept.front().bytes;
  report["landmarks"] = kept.front().landmarks;
  report["places"] = kept.front().places;
  report["ate_first_half_m"] = first->ate_m;
  report["another_map"] = second->another_map;
  report["found_after_s"] = second->found_s ? Json(*second->found_s) : Json(nullptr);
  report["frames"] = second->frames;
  report["tracked"] = second->tracked;
  report["marks"] = first->marks;
  report["marks_back"] = second->back;
  const auto both = [&](const char* key, const Sample& sample) {
    report[key] = sample.size() == 0
                      ? Json(nullptr)
                      : Json{{"median", sample.Percentile(50)}, {"p95", sample.Percentile(95)}};
  };
  both("marks_px", second->marks_px);
  both("marks_m", second->marks_m);
  both("pose_m", second->pose_m);
  const std::string text = report.dump(2) + "\n";
  std::cout << text;
  return WriteFileAtomically(arguments.out / "report.json", text);
}

}  // namespace saccade
