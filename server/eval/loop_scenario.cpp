#include "server/eval/loop_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/statistics.hpp"
#include "server/sim/corridor_source.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBeyond_m = 6.0;    // walked on after once round
constexpr double kEnd_m = 1.0;       // of that, over which the end error is taken
constexpr int kMarkEvery = 90;       // frames between clicks
constexpr double kNearSeam_m = 6.0;  // a mark set later than this before the end had no time
constexpr double kLensError = 0.02;  // else nothing drifts so far that the search misses it
constexpr const char* kCorrected = "the map was corrected";

/// One tracker that walks along.
class Walker {
 public:
  static absl::StatusOr<std::unique_ptr<Walker>> Create(const CorridorSource& source,
                                                        const SimArguments& arguments, bool loops) {
    TrackerArguments options = arguments.tracker;
    options.set.push_back(absl::StrCat("loops=", loops ? 1 : 0));
    absl::StatusOr<std::unique_ptr<Wearable>> wearable = MakeWearable(source.info(), options);
    if (!wearable.ok()) return wearable.status();
    absl::StatusOr<OutputFile> file =
        OutputFile::Create(arguments.out / absl::StrFormat("seed-%d-%s.csv", arguments.seed,
                                                           loops ? "loops" : "none"));
    if (!file.ok()) return file.status();
    file->Write("frame,way_m,status,error_m,revision,features,frame_ms\n");
    return std::make_unique<Walker>(source, *std::move(wearable), *std::move(file));
  }

  Walker(const CorridorSource& source, std::unique_ptr<Wearable> wearable, OutputFile file)
      : source_(source), wearable_(std::move(wearable)), file_(std::move(file)) {}

  void Step(const Frame& frame) {
    const std::vector<double> marks_before = MarkErrors();
    const WearableStep& step = wearable_->Step(frame);
    const std::shared_ptr<const MapSnapshot>& snapshot = step.snapshot;
    const double error_m =
        (snapshot->world_from_camera.translation - source_.WorldFromCamera(frame.id).translation)
            .norm();
    const double way_m = source_.Way_m(frame.id);
    const bool tracked = snapshot->status == TrackingStatus::kTracking;
    tracked_ += tracked ? 1 : 0;
    const bool jumped = revision_ && *revision_ != snapshot->map_revision;
    revision_ = snapshot->map_revision;
    last_features_ = snapshot->features.size();
    frame_ms_.Add(snapshot->stage_ms.total_ms);
    steps_.push_back({way_m, snapshot->world_from_camera.translation,
                      source_.WorldFromCamera(frame.id).translation});
    if (way_m > CorridorSource::Round_m() + kBeyond_m - kEnd_m && tracked) BookEnd();
    file_.Write(absl::StrFormat("%d,%.3f,%d,%.4f,%d,%d,%.2f\n", frame.id, way_m,
                                static_cast<int>(snapshot->status), error_m, snapshot->map_revision,
                                snapshot->features.size(), snapshot->stage_ms.total_ms));
    for (const AnchorMoved& moved : step.moved) {
      moved_ += moved.cause == kCorrected ? 1 : 0;
    }
    if (jumped) {
      jumps_.push_back({{"way_m", way_m},
                        {"error_before_m", last_error_m_},
                        {"error_after_m", error_m},
                        {"marks_before_m", marks_before},
                        {"marks_after_m", MarkErrors()}});
    }
    last_error_m_ = error_m;
    if (tracked && frame.id % kMarkEvery == kMarkEvery - 1 &&
        way_m < CorridorSource::Round_m() - kNearSeam_m) {
      Mark(frame);
    }
  }

  Json Report() {
    Json report;
    report["tracked_frames"] = tracked_;
    report["end_error_m"] = end_m_.size() == 0 ? Json(nullptr) : Json(end_m_.Mean());
    report["map_features"] = last_features_;
    report["corrections"] = jumps_;
    report["marks"] = marks_.size();
    report["marks_moved_by_correction"] = moved_;
    const std::vector<double> now = MarkErrors();
    double sum = 0.0;
    for (const double error : now) sum += error;
    report["mark_error_m"] =
        now.empty() ? Json(nullptr) : Json(sum / static_cast<double>(now.size()));
    report["frame_ms"] = {{"p50", frame_ms_.Percentile(50)},
                          {"p99", frame_ms_.Percentile(99)},
                          {"max", frame_ms_.Max()}};
    return report;
  }
  absl::Status Close() { return file_.Close(); }
  double end_error_m() const { return end_m_.size() == 0 ? 1e9 : end_m_.Mean(); }

 private:
  struct Marked {
    std::string id;
    Eigen::Vector3d true_point;
  };

  /// How far the camera is from where it was when it was here first, beyond what it truly is.
  void BookEnd() {
    const Walked& now = steps_.back();
    const auto first =
        std::lower_bound(steps_.begin(), steps_.end(), now.way_m - CorridorSource::Round_m(),
                         [](const Walked& walked, double way_m) { return walked.way_m < way_m; });
    end_m_.Add(((now.published - first->published) - (now.truth - first->truth)).norm());
  }

  /// Clicks what is in the picture's middle.
  void Mark(const Frame& frame) {
    const Eigen::Vector2d pixel(0.5 * frame.camera->width(), 0.5 * frame.camera->height());
    const absl::StatusOr<Annotation> placed =
        PlaceAsExpert(*wearable_, PixelTarget{frame.id, pixel}, static_cast<int>(frame.id));
    if (!placed.ok()) return;
    marks_.push_back({placed->id, source_.PointAt(frame.id, pixel)});
  }

  std::vector<double> MarkErrors() const {
    std::vector<double> errors;
    for (const Annotation& annotation : *wearable_->annotations()) {
      for (const Marked& marked : marks_) {
        if (marked.id != annotation.id) continue;
        errors.push_back((annotation.anchor.point_in_world - marked.true_point).norm());
      }
    }
    return errors;
  }

  const CorridorSource& source_;
  std::unique_ptr<Wearable> wearable_;
  OutputFile file_;
  std::vector<Marked> marks_;
  struct Walked {
    double way_m;
    Eigen::Vector3d published, truth;  // [m, world]
  };
  std::vector<Walked> steps_;
  Sample end_m_, frame_ms_;
  Json jumps_ = Json::array();
  std::optional<std::uint64_t> revision_;
  std::size_t tracked_ = 0, last_features_ = 0;
  double last_error_m_ = 0.0;
  int moved_ = 0;
};

absl::StatusOr<Json> RunOne(const SimArguments& arguments) {
  CorridorOptions options;
  options.seed = arguments.seed;
  options.lens_error = kLensError;
  options.way_m = CorridorSource::Round_m() + kBeyond_m;
  CorridorSource source(options);
  auto with = Walker::Create(source, arguments, true);
  if (!with.ok()) return with.status();
  auto without = Walker::Create(source, arguments, false);
  if (!without.ok()) return without.status();
  while (true) {
    const absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    (*with)->Step(**frame);
    (*without)->Step(**frame);
  }
  Json report;
  report["seed"] = arguments.seed;
  report["way_m"] = options.way_m;
  report["frames"] = *source.info().frame_count;
  report["loops"] = (*with)->Report();
  report["none"] = (*without)->Report();
  report["ratio"] = (*without)->end_error_m() / (*with)->end_error_m();
  for (const absl::Status& status : {(*with)->Close(), (*without)->Close()}) {
    if (!status.ok()) return status;
  }
  return report;
}

}  // namespace

absl::StatusOr<Json> RunLoopScenario(const SimArguments& arguments) {
  if (const absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  Json report;
  report["scenario"] = "loop";
  report["runs"] = arguments.runs;
  report["per_run"] = Json::array();
  double least = 1e9;
  for (int run = 0; run < arguments.runs; ++run) {
    SimArguments one = arguments;
    one.seed += static_cast<std::uint64_t>(run);
    absl::StatusOr<Json> result = RunOne(one);
    if (!result.ok()) return result.status();
    least = std::min(least, (*result)["ratio"].get<double>());
    std::cerr << absl::StrFormat("seed %d: ratio %.1f\n", one.seed,
                                 (*result)["ratio"].get<double>());
    report["per_run"].push_back(*std::move(result));
  }
  report["least_ratio"] = least;
  return report;
}

}  // namespace saccade
