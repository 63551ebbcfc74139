#include "server/eval/run.hpp"

#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/run_recorder.hpp"

namespace saccade {
namespace {

constexpr Timestamp kProgressEvery_ns = 10'000'000'000;

}  // namespace

absl::StatusOr<nlohmann::ordered_json> RunTracker(FrameSource& source, const TrackFunction& track,
                                                  const Trajectory& truth,
                                                  const std::filesystem::path& folder,
                                                  const ReportMore& more) {
  absl::StatusOr<RunRecorder> recorder = RunRecorder::Create(folder);
  if (!recorder.ok()) return recorder.status();
  Timestamp told = MonotonicNow();
  bool metric = false;
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    CostMeter meter;
    const std::shared_ptr<const MapSnapshot> snapshot = track(**frame);
    const FrameCost cost = meter.Read(snapshot->stage_ms.waited_ms);
    if (const absl::Status status = recorder->Add(**frame, *snapshot, cost); !status.ok()) {
      return status;
    }
    metric = snapshot->metric;
    if (MonotonicNow() - told > kProgressEvery_ns) {
      told = MonotonicNow();
      std::cerr << absl::StrFormat("frame %d of %d: %s, %d features\n", recorder->frames(),
                                   source.info().frame_count.value_or(0),
                                   ToString(VerdictOf(*snapshot)), snapshot->features.size());
    }
  }
  if (const absl::Status status = recorder->Close(); !status.ok()) return status;
  if (recorder->frames() == 0) {
    return absl::InvalidArgumentError(
        "no frame is left of the recording; look at --frames, --drop and --every");
  }
  nlohmann::ordered_json report = recorder->Report(source.bad_frames());
  if (!truth.empty()) {
    const auto interval_ns = static_cast<Timestamp>(1e9 / source.info().camera->intrinsics().fps);
    AddScores(Associate(recorder->trajectory(), truth, interval_ns), metric, report);
  }
  if (more) more(report);
  const absl::Status written = WriteFileAtomically(folder / "report.json", report.dump(2) + "\n");
  if (!written.ok()) return written;
  return report;
}

}  // namespace saccade
