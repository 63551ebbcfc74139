#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <array>
#include <fstream>
#include <opencv2/core/utility.hpp>

#include "server/capture/dataset.hpp"
#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"
#include "tests/bench/bench.hpp"

namespace saccade {
namespace {

enum Stage { kPredict, kSearch, kUpdate, kManage, kWhole, kStages };
constexpr std::array<const char*, kStages> kStageNames = {"predict", "search", "update", "manage",
                                                          "frame"};

absl::StatusOr<std::unique_ptr<FrameSource>> OpenSource(const FrameBenchArguments& arguments) {
  if (!arguments.dataset.empty()) return OpenDataset(arguments.dataset, {});
  auto source = SimSource::OpenUri(arguments.source, {});
  if (!source.ok()) return source.status();
  return std::unique_ptr<FrameSource>(*std::move(source));
}

absl::StatusOr<TrackerOptions> ReadOptions(const FrameBenchArguments& arguments) {
  TrackerOptions options;
  if (!arguments.config.empty()) {
    if (const absl::Status status = options.LoadToml(arguments.config); !status.ok()) return status;
  }
  for (const std::string& pair : arguments.set) {
    if (const absl::Status status = options.SetPair(pair); !status.ok()) return status;
  }
  return options;
}

/// Everything decoded or drawn beforehand: nothing but the tracker runs while times are taken.
absl::StatusOr<std::vector<Frame>> AllFrames(FrameSource& source) {
  std::vector<Frame> frames;
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) return frames;
    frames.push_back(**std::move(frame));
  }
}

/// What one run came to; the runs must agree or their least times mean nothing.
struct Outcome {
  std::size_t tracked = 0;
  Rigid3 last_pose;
};

absl::StatusOr<Outcome> RunOnce(const SourceInfo& info, const TrackerOptions& options,
                                const std::vector<Frame>& frames,
                                std::array<LeastTimes, kStages>& least) {
  auto tracker = Tracker::Create(info, options);
  if (!tracker.ok()) return tracker.status();
  Outcome outcome;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    StopWatch watch;
    const std::shared_ptr<const MapSnapshot> snapshot = (*tracker)->Track(frames[k]);
    least[kWhole].Add(k, watch.Lap_ms() - snapshot->stage_ms.waited_ms);
    least[kPredict].Add(k, snapshot->stage_ms.predict_ms);
    least[kSearch].Add(k, snapshot->stage_ms.search_ms);
    least[kUpdate].Add(k, snapshot->stage_ms.update_ms);
    least[kManage].Add(k, snapshot->stage_ms.manage_ms);
    outcome.tracked += snapshot->status == TrackingStatus::kTracking ? 1 : 0;
    outcome.last_pose = snapshot->world_from_camera;
  }
  return outcome;
}

absl::Status WriteFrames(const std::filesystem::path& file,
                         const std::array<LeastTimes, kStages>& least) {
  if (file.empty()) return absl::OkStatus();
  std::ofstream out(file);
  std::array<Sample, kStages> samples;
  out << "frame";
  for (int stage = 0; stage < kStages; ++stage) {
    samples[stage] = least[stage].ToSample();
    out << "," << kStageNames[stage] << "_ms";
  }
  for (std::size_t k = 0; k < samples[0].size(); ++k) {
    out << "\n" << k;
    for (const Sample& sample : samples) out << "," << absl::StrFormat("%.4f", sample.values()[k]);
  }
  out << "\n";
  out.close();
  if (out.fail()) {
    return absl::NotFoundError(
        absl::StrCat("--frames-csv ", file.string(), ": cannot be written; is there room?"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TimingReport> BenchFrame(const FrameBenchArguments& arguments) {
  cv::setNumThreads(1);
  const absl::StatusOr<TrackerOptions> options = ReadOptions(arguments);
  if (!options.ok()) return options.status();
  absl::StatusOr<std::unique_ptr<FrameSource>> source = OpenSource(arguments);
  if (!source.ok()) return source.status();
  const SourceInfo info = (*source)->info();
  if (arguments.dataset.empty() && !info.frame_count) {
    return absl::InvalidArgumentError("--source has no end; add duration=SECONDS");
  }
  const absl::StatusOr<std::vector<Frame>> frames = AllFrames(**source);
  if (!frames.ok()) return frames.status();
  source->reset();
  std::array<LeastTimes, kStages> least;
  std::optional<Outcome> first;
  for (int run = 0; run < arguments.runs; ++run) {
    const absl::StatusOr<Outcome> outcome = RunOnce(info, *options, *frames, least);
    if (!outcome.ok()) return outcome.status();
    if (!first) first = *outcome;
    if (outcome->tracked != first->tracked ||
        outcome->last_pose.translation != first->last_pose.translation) {
      return absl::InternalError("bench frame: two runs differ; the tracker is not deterministic");
    }
  }
  if (const absl::Status status = WriteFrames(arguments.frames_csv, least); !status.ok()) {
    return status;
  }
  TimingReport report;
  report.bench = "frame";
  report.facts = {{"source", arguments.dataset.empty() ? "sim:" + arguments.source
                                                       : arguments.dataset.string()},
                  {"size", absl::StrCat(info.camera->width(), " x ", info.camera->height())},
                  {"tracked", absl::StrCat(first->tracked, " of ", frames->size(), " frames")},
                  {"times", absl::StrCat("of each frame the least of ", arguments.runs, " runs")}};
  for (int stage = 0; stage < kStages; ++stage) {
    report.rows.push_back({"", kStageNames[stage], least[stage].ToSample(),
                           stage == kWhole ? std::optional(15.0) : std::nullopt});
  }
  return report;
}

}  // namespace saccade
