#include "server/eval/run_recorder.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>

#include "server/eval/false_tracked.hpp"
#include "server/eval/scale_windows.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kFlushEvery = 30;  // frames: what a killed run may lose

/// Times to the microsecond; more digits only make files long.
double Rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json TimesOf(const Sample& sample) {
  return {{"p50", Rounded(sample.Percentile(50))},
          {"p95", Rounded(sample.Percentile(95))},
          {"p99", Rounded(sample.Percentile(99))},
          {"max", Rounded(sample.Max())}};
}

void AddScaleAndFalse(const std::vector<PosePair>& pairs, bool metric, Json& report) {
  const std::optional<ScaleWindows> windows = ScaleOfWindows(pairs);
  report["scale_windows"] =
      windows ? Json{{"min", windows->min}, {"max", windows->max}, {"windows", windows->windows}}
              : Json(nullptr);
  const FalseTracked wrong =
      CountFalseTracked(pairs, metric ? TrajectoryAlignment::kSe3 : TrajectoryAlignment::kSim3);
  const bool known = pairs.size() >= 3;
  report["false_tracked_frames"] = known ? Json(wrong.frames) : Json(nullptr);
  report["false_tracked"] =
      known ? Json{{"against_before", wrong.against_before},
                   {"against_whole", wrong.against_whole},
                   {"worst_m", wrong.worst_m},
                   {"first_s",
                    wrong.first_time_ns ? Json(Seconds(*wrong.first_time_ns)) : Json(nullptr)}}
            : Json(nullptr);
}

}  // namespace

FrameVerdict VerdictOf(const MapSnapshot& snapshot) {
  switch (snapshot.status) {
    case TrackingStatus::kInitialising:
      return FrameVerdict::kInitialising;
    case TrackingStatus::kTracking:
      return snapshot.matched >= kMinTrackedMatches ? FrameVerdict::kTracked
                                                    : FrameVerdict::kCoasting;
    case TrackingStatus::kCoasting:
      return FrameVerdict::kCoasting;
    case TrackingStatus::kLost:
    case TrackingStatus::kRelocalising:
      return FrameVerdict::kLost;
  }
  return FrameVerdict::kLost;
}

const char* ToString(FrameVerdict verdict) {
  constexpr const char* kNames[] = {"initialising", "tracked", "coasting", "lost"};
  return kNames[static_cast<std::size_t>(verdict)];
}

absl::StatusOr<RunRecorder> RunRecorder::Create(const std::filesystem::path& folder) {
  if (const absl::Status status = CreateFolder(folder); !status.ok()) return status;
  absl::StatusOr<OutputFile> trajectory = OutputFile::Create(folder / "trajectory.tum");
  if (!trajectory.ok()) return trajectory.status();
  absl::StatusOr<OutputFile> frames = OutputFile::Create(folder / "frames.csv");
  if (!frames.ok()) return frames.status();
  frames->Write("frame,timestamp,status,attempted,matched,wall_ms,cpu_ms\n");
  return RunRecorder(*std::move(trajectory), *std::move(frames));
}

absl::Status RunRecorder::Add(const Frame& frame, const MapSnapshot& snapshot,
                              const FrameCost& cost, std::optional<FrameVerdict> verdict) {
  const FrameVerdict status = verdict.value_or(VerdictOf(snapshot));
  const std::string stamp = frame.source_timestamp.empty()
                                ? absl::StrFormat("%.9f", Seconds(frame.capture_time_ns))
                                : frame.source_timestamp;
  if (status == FrameVerdict::kTracked) {
    trajectory_.push_back({frame.capture_time_ns, snapshot.world_from_camera});
    trajectory_file_.Write(TumLine(stamp, snapshot.world_from_camera));
  }
  frames_file_.Write(absl::StrFormat("%d,%s,%s,%d,%d,%.3f,%.3f\n", frame.id, stamp,
                                     ToString(status), snapshot.attempted, snapshot.matched,
                                     cost.wall_ms, cost.cpu_ms));
  ++frames_;
  if (CountOf(FrameVerdict::kTracked) > 0 &&
      (status == FrameVerdict::kLost || status == FrameVerdict::kInitialising)) {
    ++lost_after_start_;
  }
  ++counts_[static_cast<std::size_t>(status)];
  metric_ = snapshot.metric;
  features_.Add(static_cast<double>(snapshot.features.size()));
  wall_ms_.Add(cost.wall_ms);
  cpu_ms_.Add(cost.cpu_ms);
  predict_ms_.Add(snapshot.stage_ms.predict_ms);
  search_ms_.Add(snapshot.stage_ms.search_ms);
  update_ms_.Add(snapshot.stage_ms.update_ms);
  manage_ms_.Add(snapshot.stage_ms.manage_ms);
  if (frames_ % kFlushEvery == 0) {
    trajectory_file_.Flush().IgnoreError();  // kept in status()
    frames_file_.Flush().IgnoreError();
  }
  if (!trajectory_file_.status().ok()) return trajectory_file_.status();
  return frames_file_.status();
}

Json RunRecorder::Report(std::uint64_t bad_frames) const {
  Json report;
  report["frames"] = frames_;
  report["initialising_frames"] = CountOf(FrameVerdict::kInitialising);
  report["tracked_frames"] = CountOf(FrameVerdict::kTracked);
  report["coasting_frames"] = CountOf(FrameVerdict::kCoasting);
  report["lost_frames"] = CountOf(FrameVerdict::kLost);
  report["lost_after_start_frames"] = lost_after_start_;
  report["bad_frames"] = bad_frames;
  report["metric"] = metric_;
  report["features"] = {{"mean", Rounded(features_.Mean())}, {"max", features_.Max()}};
  report["frame_ms"] = TimesOf(wall_ms_);
  report["frame_cpu_ms"] = TimesOf(cpu_ms_);
  report["stage_ms"] = {{"predict", Rounded(predict_ms_.Mean())},
                        {"search", Rounded(search_ms_.Mean())},
                        {"update", Rounded(update_ms_.Mean())},
                        {"manage", Rounded(manage_ms_.Mean())}};
  report["stage_p99_ms"] = {{"predict", Rounded(predict_ms_.Percentile(99))},
                            {"search", Rounded(search_ms_.Percentile(99))},
                            {"update", Rounded(update_ms_.Percentile(99))},
                            {"manage", Rounded(manage_ms_.Percentile(99))}};
  return report;
}

absl::Status RunRecorder::Close() {
  const absl::Status trajectory = trajectory_file_.Close();
  const absl::Status frames = frames_file_.Close();
  return trajectory.ok() ? frames : trajectory;
}

void AddScores(const std::vector<PosePair>& pairs, bool metric, Json& report) {
  const absl::StatusOr<TrajectoryScore> score =
      Score(pairs, metric ? TrajectoryAlignment::kSe3 : TrajectoryAlignment::kSim3);
  report["truth_frames"] = pairs.size();
  const auto put = [&](const char* key, std::optional<double> value) {
    report[key] = value ? Json(*value) : Json(nullptr);
  };
  const auto of = [&](double TrajectoryScore::*field) {
    return score.ok() ? std::optional((*score).*field) : std::nullopt;
  };
  put("ate_se3_m", of(&TrajectoryScore::ate_se3_m));
  put("ate_sim3_m", of(&TrajectoryScore::ate_sim3_m));
  put("ate_null_m", of(&TrajectoryScore::ate_null_m));
  put("scale", of(&TrajectoryScore::scale));
  put("ate_se3_deg", of(&TrajectoryScore::rotation_se3_deg));
  put("ate_sim3_deg", of(&TrajectoryScore::rotation_sim3_deg));
  put("rpe_1s_m", score.ok() ? score->rpe_1s_m : std::nullopt);
  put("rpe_1s_deg", score.ok() ? score->rpe_1s_deg : std::nullopt);
  AddScaleAndFalse(pairs, metric, report);
}

std::string SummaryTable(const Json& report) {
  const auto count = [&](const char* key) { return report.value(key, std::uint64_t{0}); };
  std::string text = absl::StrFormat(
      "frames       %6d   (bad %d)\ninitialising %6d\ntracked      %6d\ncoasting     %6d\n"
      "lost         %6d   (%d after the start)\nmetric       %6s\n",
      count("frames"), count("bad_frames"), count("initialising_frames"), count("tracked_frames"),
      count("coasting_frames"), count("lost_frames"), count("lost_after_start_frames"),
      report.value("metric", false) ? "yes" : "no");
  const Json& features = report["features"];
  const Json& frame_ms = report["frame_ms"];
  absl::StrAppendFormat(&text, "features     %6.1f   (max %.0f)\n", features["mean"].get<double>(),
                        features["max"].get<double>());
  absl::StrAppendFormat(&text, "frame [ms]   %6.2f   (p95 %.2f, p99 %.2f, max %.2f)\n",
                        frame_ms["p50"].get<double>(), frame_ms["p95"].get<double>(),
                        frame_ms["p99"].get<double>(), frame_ms["max"].get<double>());
  if (!report.contains("ate_se3_m")) return text + "truth            none\n";
  if (report["ate_se3_m"].is_null()) return text + "ATE              too few poses with truth\n";
  const double null_m = report["ate_null_m"].get<double>();
  absl::StrAppendFormat(&text,
                        "ATE SE3      %6.2f cm    standing still %.2f cm\n"
                        "ATE Sim3     %6.2f cm    standing still %.2f cm    scale %.4f\n",
                        100 * report["ate_se3_m"].get<double>(), 100 * null_m,
                        100 * report["ate_sim3_m"].get<double>(), 100 * null_m,
                        report["scale"].get<double>());
  if (!report["rpe_1s_m"].is_null()) {
    absl::StrAppendFormat(&text, "RPE 1 s      %6.2f cm    %.3f deg\n",
                          100 * report["rpe_1s_m"].get<double>(),
                          report["rpe_1s_deg"].get<double>());
  }
  if (!report["scale_windows"].is_null()) {
    absl::StrAppendFormat(&text, "scale 3 s    %6.3f to %.3f of the whole\n",
                          report["scale_windows"]["min"].get<double>(),
                          report["scale_windows"]["max"].get<double>());
  }
  absl::StrAppendFormat(&text, "false tracked %5d   (more than 15 cm off; worst %.1f cm)\n",
                        count("false_tracked_frames"),
                        100 * report["false_tracked"]["worst_m"].get<double>());
  return text;
}

}  // namespace saccade
