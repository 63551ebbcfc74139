#include "server/eval/commands.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>

#include "server/capture/dataset.hpp"
#include "server/eval/altered_source.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/frame_range.hpp"
#include "server/eval/run.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/score.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {

namespace {

absl::StatusOr<Alterations> AlterationsOf(const RunArguments& arguments) {
  Alterations alterations;
  for (const std::string& text : arguments.drop) {
    const absl::StatusOr<FrameRange> range = ParseFrameRange(text, "--drop");
    if (!range.ok()) return range.status();
    alterations.drop.push_back(*range);
  }
  alterations.every = arguments.every;
  if (!arguments.freeze.empty()) {
    const absl::StatusOr<Freeze> freeze = ParseFreeze(arguments.freeze);
    if (!freeze.ok()) return freeze.status();
    alterations.freeze = *freeze;
  }
  return alterations;
}

using Json = nlohmann::ordered_json;

/// What became of a lens that was learnt; for the report.
class LensCourse {
 public:
  void Note(const Frame& frame, const std::optional<LensState>& lens) {
    if (!lens) return;
    if (!begin_ns_) begin_ns_ = frame.capture_time_ns;
    if (!newest_ || newest_->changes != lens->changes) {
      Json change = ToJson(*lens);
      change["frame"] = frame.id;
      change["time_s"] = Seconds(frame.capture_time_ns - *begin_ns_);
      changes_.push_back(std::move(change));
    }
    newest_ = lens;
  }
  /// `lens`: as it is in the end, and each change; nothing where it was given.
  void Add(Json& report) const {
    if (!newest_) return;
    report["lens"] = ToJson(*newest_);
    report["lens"]["learnt"] = newest_->learnt;
    report["lens"]["course"] = changes_;
  }
  std::string Line() const {
    if (!newest_) return "";
    return absl::StrFormat("lens      %9s   f %.1f +- %.1f px, centre (%.1f, %.1f), k1 %.3f\n",
                           newest_->learnt ? "learnt" : "learning", newest_->focal_px,
                           newest_->focal_sigma_px, newest_->centre_px.x(), newest_->centre_px.y(),
                           newest_->k1);
  }

 private:
  static Json ToJson(const LensState& lens) {
    return {{"focal_px", lens.focal_px},
            {"focal_sigma_px", lens.focal_sigma_px},
            {"centre_px", {lens.centre_px.x(), lens.centre_px.y()}},
            {"centre_sigma_px", {lens.centre_sigma_px.x(), lens.centre_sigma_px.y()}},
            {"k1", lens.k1},
            {"k1_sigma", lens.k1_sigma},
            {"k2", lens.k2},
            {"k2_sigma", lens.k2_sigma}};
  }

  std::optional<Timestamp> begin_ns_;
  std::optional<LensState> newest_;
  Json changes_ = Json::array();
};

}  // namespace

absl::Status RunCommand(const RunArguments& arguments) {
  absl::StatusOr<Alterations> alterations = AlterationsOf(arguments);
  if (!alterations.ok()) return alterations.status();
  const absl::StatusOr<FrameRange> range = ParseFrameRange(arguments.frames);
  if (!range.ok()) return range.status();
  SourceOptions options;
  options.first_frame = range->first;
  options.end_frame = range->end;
  if (arguments.fps > 0) options.fps = arguments.fps;
  if (arguments.view_deg > 0) options.view_deg = arguments.view_deg;
  options.lens_may_be_missing = true;
  auto opened = OpenDataset(arguments.dataset, options);
  if (!opened.ok()) return opened.status();
  const std::unique_ptr<FrameSource> source = Altered(*std::move(opened), *std::move(alterations));
  Trajectory truth;
  if (MayExist(arguments.dataset / "groundtruth.txt")) {
    absl::StatusOr<Trajectory> loaded = LoadTrajectory(arguments.dataset / "groundtruth.txt");
    if (!loaded.ok()) return loaded.status();
    truth = *std::move(loaded);
  }
  // A map of squares beside the pictures is used, unless another is named: a later --set wins.
  TrackerArguments setup = arguments.tracker;
  if (const auto squares = arguments.dataset / "landmarks.toml"; MayExist(squares)) {
    setup.set.insert(setup.set.begin(), absl::StrCat("landmarks.file=", squares.string()));
  }
  const auto tracker = MakeFrameTracker(source->info(), setup);
  if (!tracker.ok()) return tracker.status();
  LensCourse course;
  const auto report = RunTracker(
      *source,
      [&](const Frame& frame) {
        auto snapshot = (*tracker)->Track(frame);
        course.Note(frame, (*tracker)->lens_state());
        return snapshot;
      },
      truth, arguments.out, [&](Json& whole) { course.Add(whole); });
  if (!report.ok()) return report.status();
  std::cout << (arguments.json ? report->dump(2) + "\n" : SummaryTable(*report) + course.Line());
  return absl::OkStatus();
}

absl::Status ScoreCommand(const ScoreArguments& arguments) {
  const absl::StatusOr<Trajectory> estimate = LoadTrajectory(arguments.estimate);
  if (!estimate.ok()) return estimate.status();
  const absl::StatusOr<Trajectory> truth = LoadTrajectory(arguments.truth);
  if (!truth.ok()) return truth.status();
  const bool metric = arguments.align == "se3";
  const std::vector<PosePair> pairs = Associate(*estimate, *truth);
  const absl::StatusOr<TrajectoryScore> score =
      Score(pairs, metric ? TrajectoryAlignment::kSe3 : TrajectoryAlignment::kSim3);
  if (!score.ok()) {
    return absl::Status(score.status().code(),
                        absl::StrCat(arguments.estimate.string(), " against ",
                                     arguments.truth.string(), ": ", score.status().message()));
  }
  nlohmann::ordered_json report;
  report["estimate_frames"] = estimate->size();
  report["align"] = arguments.align;
  report["ate_m"] = metric ? score->ate_se3_m : score->ate_sim3_m;
  AddScores(pairs, metric, report);
  std::cout << report.dump(2) << "\n";
  return absl::OkStatus();
}

}  // namespace saccade
