#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "server/capture/frame.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/score.hpp"
#include "server/eval/statistics.hpp"
#include "server/eval/trajectory.hpp"
#include "server/pipeline/frame_cost.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What a frame counts as in an evaluation. Relocalising counts as lost.
enum class FrameVerdict { kInitialising, kTracked, kCoasting, kLost };

/// Fewer accepted matches make a frame coasting, not tracked, whatever its status says.
inline constexpr int kMinTrackedMatches = 5;

FrameVerdict VerdictOf(const MapSnapshot& snapshot);
const char* ToString(FrameVerdict verdict);

/// Writes trajectory.tum and frames.csv while a run goes on, and report.json at its end
/// (architecture section 4). Poses are written as published and never revised. One thread.
class RunRecorder {
 public:
  /// Creates `folder` and the two files in it.
  static absl::StatusOr<RunRecorder> Create(const std::filesystem::path& folder);

  /// Records one frame; an error is a failed write. `verdict` overrides VerdictOf, for runs that
  /// know the truth and count a wrong pose as lost.
  absl::Status Add(const Frame& frame, const MapSnapshot& snapshot, const FrameCost& cost,
                   std::optional<FrameVerdict> verdict = std::nullopt);

  /// The published poses of tracked frames so far.
  const Trajectory& trajectory() const { return trajectory_; }
  std::uint64_t frames() const { return frames_; }
  /// Frames after the first tracked one that were lost, relocalising or initialising again.
  std::uint64_t lost_after_start() const { return lost_after_start_; }
  std::uint64_t CountOf(FrameVerdict verdict) const {
    return counts_[static_cast<std::size_t>(verdict)];
  }

  /// The report without the scores: counts, features, times.
  nlohmann::ordered_json Report(std::uint64_t bad_frames) const;
  /// Closes the two files.
  absl::Status Close();

 private:
  RunRecorder(OutputFile trajectory, OutputFile frames)
      : trajectory_file_(std::move(trajectory)), frames_file_(std::move(frames)) {}

  OutputFile trajectory_file_, frames_file_;
  Trajectory trajectory_;
  std::uint64_t frames_ = 0, lost_after_start_ = 0;
  std::array<std::uint64_t, 4> counts_{};
  bool metric_ = false;
  Sample features_, wall_ms_, cpu_ms_, predict_ms_, search_ms_, update_ms_, manage_ms_;
};

/// Adds ate_se3_m, ate_sim3_m, ate_null_m, scale, rpe_1s_m and rpe_1s_deg and their rotations,
/// scale_windows (ScaleOfWindows), false_tracked_frames and false_tracked (FalseTracked); nulls
/// where fewer than three poses have a truth. `pairs`: the poses published as tracked. `metric`:
/// relative errors and false claims without Sim3 scale.
void AddScores(const std::vector<PosePair>& pairs, bool metric, nlohmann::ordered_json& report);

/// The report as a table for people, null error beside each ATE.
std::string SummaryTable(const nlohmann::ordered_json& report);

}  // namespace saccade
