#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <array>
#include <ctime>
#include <opencv2/core/utility.hpp>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/frame_ring.hpp"
#include "server/sim/corridor_source.hpp"
#include "server/tracker/tracker.hpp"
#include "tests/bench/bench.hpp"

namespace saccade {
namespace {

constexpr double kYoungAhead_s = 1.5;    // that the young tracker begins before what is timed
constexpr double kMiddleAhead_s = 20.0;  // that the middle one does: once round
constexpr double kSettle_s = 2.0;        // from the end of the way until he stands
constexpr int kMarks = 3;                // clicked before what is timed, where both can see them

enum Stage { kPredict, kSearch, kUpdate, kManage, kAnchors, kWhole, kStages };
constexpr std::array<const char*, kStages> kStageNames = {"predict", "search",  "update",
                                                          "manage",  "anchors", "frame"};
using StageTable = std::array<LeastTimes, kStages>;

/// Processor time of this thread [ms]: the adjustment has the other core, and both wait for others.
double ThreadTime_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Frames that are timed, [first, end), and where the younger trackers begin.
struct Window {
  std::string name;
  std::size_t young_from = 0, middle_from = 0, first = 0, end = 0;
};

/// What one tracker did in a window; equal in every run but for the times.
struct Trial {
  std::vector<bool> tracked;
  Sample landmarks;
  Eigen::Vector3d last_position = Eigen::Vector3d::Zero();
};

/// A tracker and what follows it on the server's tracker thread.
class Pipeline {
 public:
  static absl::StatusOr<std::unique_ptr<Pipeline>> Create(const SourceInfo& info,
                                                          const TrackerOptions& options) {
    auto tracker = Tracker::Create(info, options);
    if (!tracker.ok()) return tracker.status();
    return std::make_unique<Pipeline>(*std::move(tracker));
  }

  explicit Pipeline(std::unique_ptr<Tracker> tracker)
      : tracker_(std::move(tracker)),
        anchors_(
            AnchorOptions(), [this](FrameId) { return newest_; }, nullptr) {}

  void Step(const Frame& frame, std::size_t item, StageTable* least, Trial* trial) {
    const double begin_ms = ThreadTime_ms();
    const std::shared_ptr<const MapSnapshot> map = tracker_->Track(frame);
    const double tracked_ms = ThreadTime_ms();
    newest_ = {std::make_shared<const Frame>(frame), map};
    const double before_anchors_ms = ThreadTime_ms();
    anchors_.Resolve(map, *frame.camera);
    const double anchors_ms = ThreadTime_ms() - before_anchors_ms;
    if (least == nullptr) return;
    const StageTimes& stages = map->stage_ms;
    (*least)[kPredict].Add(item, stages.predict_ms);
    (*least)[kSearch].Add(item, stages.search_ms);
    (*least)[kUpdate].Add(item, stages.update_ms);
    (*least)[kManage].Add(item, stages.manage_ms);
    (*least)[kAnchors].Add(item, anchors_ms);
    (*least)[kWhole].Add(item, tracked_ms - begin_ms + anchors_ms);
    trial->tracked.push_back(map->status == TrackingStatus::kTracking);
    trial->landmarks.Add(static_cast<double>(map->features.size()));
    trial->last_position = map->world_from_camera.translation;
  }

  /// A mark on the newest picture, `share` of its width from the left.
  void Mark(double share) {
    const CameraModel& camera = *newest_.frame->camera;
    AnnotationDraft draft;
    draft.request_id = absl::StrFormat("00000000-0000-4000-8000-%012d", newest_.frame->id);
    draft.author = "expert";
    draft.target = PixelTarget{newest_.frame->id, {share * camera.width(), 0.5 * camera.height()}};
    const absl::StatusOr<AnnotationEdit> edit = anchors_.Create(draft, "expert");
    if (edit.ok()) anchors_.Committed(edit->change.sequence);
  }

 private:
  std::unique_ptr<Tracker> tracker_;
  PastFrame newest_;
  AnchorManager anchors_;
};

absl::StatusOr<std::vector<Frame>> AllFrames(CorridorSource& source) {
  std::vector<Frame> frames;
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) return frames;
    frames.push_back(**std::move(frame));
  }
}

/// Runs [begin, window.end), books the window.
Trial Follow(Pipeline& pipeline, const std::vector<Frame>& frames, std::size_t begin,
             const Window& window, StageTable& least) {
  Trial trial;
  for (std::size_t k = begin; k < window.end; ++k) {
    const bool timed = k >= window.first;
    pipeline.Step(frames[k], k - window.first, timed ? &least : nullptr, &trial);
    if (k < window.first && k + kMarks >= window.first) {
      pipeline.Mark(0.3 + 0.2 * static_cast<double>(window.first - k - 1));
    }
  }
  return trial;
}

/// Of the frames that both trackers tracked.
Sample Select(const LeastTimes& least, const MapComparison& comparison) {
  const Sample all = least.ToSample();
  Sample some;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (comparison.compared[k]) some.Add(all.values()[k]);
  }
  return some;
}

absl::Status Take(const std::array<Trial, kMaps>& trials, MapComparison& comparison) {
  std::vector<bool> compared(trials[kYoung].tracked.size(), true);
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  for (int map = 0; map < kMaps; ++map) {
    for (std::size_t k = 0; k < compared.size(); ++k) {
      compared[k] = compared[k] && trials[map].tracked[k];
    }
    where += trials[map].last_position;
    comparison.landmarks[map] = trials[map].landmarks.Percentile(50);
  }
  if (!comparison.compared.empty() &&
      (compared != comparison.compared || where != comparison.last_positions)) {
    return absl::InternalError("bench map: two runs differ; the tracker is not deterministic");
  }
  comparison.compared = std::move(compared);
  comparison.last_positions = where;
  return absl::OkStatus();
}

std::vector<Window> Windows(const MapBenchArguments& arguments, const CorridorSource& source) {
  const double fps = source.info().camera->intrinsics().fps;
  const auto frames = [&](double seconds) { return static_cast<std::size_t>(seconds * fps); };
  const std::size_t stop = source.StopFrame();
  const std::size_t walk = stop - frames(arguments.walk_s), stand = stop + frames(kSettle_s);
  const std::size_t middle = walk - std::min(walk, frames(kMiddleAhead_s));
  return {{"walking", walk - frames(kYoungAhead_s), middle, walk, stop},
          {"standing", stop - frames(kYoungAhead_s), middle, stand, *source.info().frame_count}};
}

absl::StatusOr<TrackerOptions> ReadOptions(const MapBenchArguments& arguments) {
  TrackerOptions options;
  if (!arguments.config.empty()) {
    if (const absl::Status status = options.LoadToml(arguments.config); !status.ok()) return status;
  }
  for (const std::string& pair : arguments.set) {
    if (const absl::Status status = options.SetPair(pair); !status.ok()) return status;
  }
  return options;
}

void Report(const MapBenchArguments& arguments, const std::vector<Window>& windows,
            const std::vector<std::array<StageTable, kMaps>>& least, MapBenchResult& result) {
  result.report.bench = "map";
  result.report.facts = {{"way", absl::StrFormat("%.0f m of corridor", arguments.way_m)},
                         {"times", absl::StrCat("of each frame the least of ", arguments.runs,
                                                " runs; anchors and frame: processor time")}};
  for (std::size_t w = 0; w < windows.size(); ++w) {
    MapComparison& comparison = result.comparisons[w];
    comparison.name = windows[w].name;
    for (int map = 0; map < kMaps; ++map) {
      const std::string group =
          absl::StrFormat("%s, %.0f landmarks", comparison.name, comparison.landmarks[map]);
      comparison.frame_ms[map] = Select(least[w][map][kWhole], comparison);
      for (int stage = 0; stage < kStages; ++stage) {
        result.report.rows.push_back(
            {group, kStageNames[stage], Select(least[w][map][stage], comparison), {}});
      }
    }
    for (const MapAge from : {kYoung, kMiddle}) {
      result.report.facts.emplace_back(
          comparison.name, absl::StrFormat("%.0f landmarks to %.0f: p50 %.3f, p99 %.3f times",
                                           comparison.landmarks[from], comparison.landmarks[kOld],
                                           comparison.Ratio(from, 50), comparison.Ratio(from, 99)));
    }
  }
}

}  // namespace

double MapComparison::Ratio(MapAge from, double percentile) const {
  return frame_ms[kOld].Percentile(percentile) / frame_ms[from].Percentile(percentile);
}

/// One run of all trackers; books times of each window and map.
absl::Status RunOnce(const SourceInfo& info, const TrackerOptions& options,
                     const std::vector<Frame>& frames, const std::vector<Window>& windows,
                     std::vector<std::array<StageTable, kMaps>>& least,
                     std::vector<MapComparison>& comparisons) {
  // The young one begins anew in every window, the others go on.
  std::array<std::unique_ptr<Pipeline>, kMaps> trackers;
  std::array<std::size_t, kMaps> at{};
  at[kMiddle] = windows.front().middle_from;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    trackers[kYoung].reset();
    at[kYoung] = windows[w].young_from;
    std::array<Trial, kMaps> trials;
    for (int map = 0; map < kMaps; ++map) {
      if (trackers[map] == nullptr) {
        auto made = Pipeline::Create(info, options);
        if (!made.ok()) return made.status();
        trackers[map] = *std::move(made);
      }
      trials[map] = Follow(*trackers[map], frames, at[map], windows[w], least[w][map]);
      at[map] = windows[w].end;
    }
    if (const absl::Status same = Take(trials, comparisons[w]); !same.ok()) return same;
  }
  return absl::OkStatus();
}

absl::StatusOr<MapBenchResult> CompareMaps(const MapBenchArguments& arguments) {
  cv::setNumThreads(1);
  const absl::StatusOr<TrackerOptions> options = ReadOptions(arguments);
  if (!options.ok()) return options.status();
  CorridorOptions corridor;
  corridor.seed = arguments.seed;
  corridor.way_m = arguments.way_m;
  corridor.stand_s = arguments.stand_s;
  corridor.speed_m_s = 1.0;
  corridor.look_round = true;
  CorridorSource source(corridor);
  const std::vector<Window> windows = Windows(arguments, source);
  const absl::StatusOr<std::vector<Frame>> frames = AllFrames(source);
  if (!frames.ok()) return frames.status();
  std::vector<std::array<StageTable, kMaps>> least(windows.size());
  MapBenchResult result;
  result.comparisons.resize(windows.size());
  for (int run = 0; run < arguments.runs; ++run) {
    const absl::Status done =
        RunOnce(source.info(), *options, *frames, windows, least, result.comparisons);
    if (!done.ok()) return done;
  }
  Report(arguments, windows, least, result);
  return result;
}

absl::StatusOr<TimingReport> BenchMap(const MapBenchArguments& arguments) {
  absl::StatusOr<MapBenchResult> result = CompareMaps(arguments);
  if (!result.ok()) return result.status();
  return std::move(result->report);
}

}  // namespace saccade
