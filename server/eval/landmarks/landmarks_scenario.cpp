#include "server/eval/landmarks/landmarks_scenario.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "server/eval/eval_wearable.hpp"
#include "server/eval/landmarks/squares_source.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/run.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/statistics.hpp"
#include "server/tracker/landmark_tracker.hpp"
#include "server/tracker/square_pose.hpp"
#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFlipped_rad = 15.0 * M_PI / 180.0;

struct LandmarksScenario {
  absl::string_view name;
  HallMotion motion;
  double duration_s;
  absl::string_view tracker;
  int width, height;
  double fps;
};
constexpr LandmarksScenario kScenarios[] = {
    {"squares", HallMotion::kSquares, 20, "koller", 768, 576, 25},  // PAL
    {"pillar", HallMotion::kPillar, 10, "koller", 768, 576, 25},
    {"passer", HallMotion::kPasser, 10, "koller", 768, 576, 25},
    {"flip", HallMotion::kFlip, 120, "fused", 512, 384, 12.5},
    {"away", HallMotion::kAway, 26, "fused", 640, 480, 20},
};

const LandmarksScenario* Find(absl::string_view name) {
  for (const LandmarksScenario& each : kScenarios) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

Json Percentiles(const Sample& sample) {
  return {{"p50", sample.Percentile(50)},
          {"p99", sample.Percentile(99)},
          {"max", sample.size() == 0 ? 0.0 : sample.Max()}};
}

/// What a run of one hall shows beside the usual report.
class HallWatch {
 public:
  HallWatch(const SquaresSource& source, OutputFile squares)
      : source_(source), squares_(std::move(squares)) {
    squares_.Write("frame,square,covered,state\n");
  }

  void Add(const Frame& frame, const MapSnapshot& snapshot) {
    const double t = Seconds(frame.capture_time_ns);
    const bool tracked = VerdictOf(snapshot) == FrameVerdict::kTracked;
    if (SquaresSource::kHalf.Holds(t)) {
      ++half_;
      half_tracked_ += tracked ? 1 : 0;
    }
    if (t >= SquaresSource::kAll.until_s && tracked && !recovered_s_) {
      recovered_s_ = t - SquaresSource::kAll.until_s;
    }
    if (tracked) {
      frame_ms_.Add(snapshot.stage_ms.total_ms);
      worst_m_ = std::max(worst_m_, (snapshot.world_from_camera.translation -
                                     source_.WorldFromCamera(frame.id).translation)
                                        .norm());
    }
  }

  /// The corners of known squares, four of each, as the tracker has them.
  void AddSquares(FrameId frame, const std::vector<FeatureState>& corners) {
    for (std::size_t k = 0; k + 1 <= corners.size() / 4; ++k) {
      const auto first = corners.begin() + static_cast<std::ptrdiff_t>(4 * k);
      const auto any = [&](FeatureState state) { return std::count(first, first + 4, state) > 0; };
      const bool covered = source_.Covered(frame, k);
      const char* word = "not_attempted";
      if (any(FeatureState::kFailed)) word = "failed";
      if (any(FeatureState::kMeasured)) word = "measured";
      if (covered) {
        ++covered_;
        covered_attempted_ += word[0] == 'n' ? 0 : 1;
      }
      for (int c = 0; c < 4; ++c) {
        if (!source_.Hidden(frame, k, c)) continue;
        ++hidden_;
        hidden_failed_ += first[c] == FeatureState::kFailed ? 1 : 0;
        hidden_measured_ += first[c] == FeatureState::kMeasured ? 1 : 0;
      }
      squares_.Write(absl::StrFormat("%d,%d,%d,%s\n", frame, source_.squares().squares[k].id,
                                     covered ? 1 : 0, word));
    }
  }

  void AddDetector(double ms) {
    if (ms > 0) detector_ms_.Add(ms);
  }

  void Report(HallMotion motion, Json& report) const {
    report["frame_ms"] = Percentiles(frame_ms_);
    report["detector_ms"] = Percentiles(detector_ms_);
    report["worst_error_m"] = worst_m_;
    if (motion == HallMotion::kFlip || motion == HallMotion::kAway) return;
    report["covered_squares"] = covered_;  // square-frames
    report["covered_attempted"] = covered_attempted_;
    if (motion != HallMotion::kSquares) {  // corner-frames behind a thing
      report["hidden_corners"] = hidden_;
      report["hidden_failed"] = hidden_failed_;
      report["hidden_measured"] = hidden_measured_;
      return;
    }
    report["half_covered_frames"] = half_;
    report["half_covered_tracked"] = half_tracked_;
    report["recovery_s"] = recovered_s_ ? Json(*recovered_s_) : Json(nullptr);
  }
  absl::Status Close() { return squares_.Close(); }

 private:
  const SquaresSource& source_;
  OutputFile squares_;
  Sample frame_ms_, detector_ms_;
  std::optional<double> recovered_s_;
  double worst_m_ = 0.0;
  int half_ = 0, half_tracked_ = 0, covered_ = 0, covered_attempted_ = 0;
  int hidden_ = 0, hidden_failed_ = 0, hidden_measured_ = 0;
};

/// What IPPE makes of a detector's corners, frame by frame, and what the filter has beside it.
class FlipCount {
 public:
  static absl::StatusOr<FlipCount> Create(const KnownSquare& square) {
    MarkerOptions options;
    options.families = {square.family};
    absl::StatusOr<std::unique_ptr<MarkerDetector>> detector =
        MakeMarkerDetector("apriltag", options);
    if (!detector.ok()) return detector.status();
    return FlipCount(square, *std::move(detector));
  }

  void Add(const Frame& frame, const Rigid3& true_world_from_camera,
           const Rigid3& world_from_camera, const std::optional<Rigid3>& mapped) {
    const Eigen::Vector3d truth = true_world_from_camera.rotation.conjugate() *
                                  (square_.world_from_square.rotation * Eigen::Vector3d::UnitZ());
    const auto off = [&](const Eigen::Vector3d& normal_in_camera) {
      return std::acos(std::clamp(normal_in_camera.dot(truth), -1.0, 1.0));
    };
    const std::vector<MarkerSighting> seen = detector_->Detect(frame.grey);
    for (const MarkerSighting& sighting : seen) {
      if (sighting.id != square_.id) continue;
      const auto pose = PoseOfSquare(*frame.camera, sighting, square_.side_m);
      if (!pose) continue;
      ++single_;
      single_flipped_ += off(pose->square_from_camera.rotation.conjugate() *
                             Eigen::Vector3d::UnitZ()) > kFlipped_rad
                             ? 1
                             : 0;
    }
    if (!mapped) return;
    const double error =
        off(world_from_camera.rotation.conjugate() * (mapped->rotation * Eigen::Vector3d::UnitZ()));
    ++mapped_;
    mapped_flipped_ += error > kFlipped_rad ? 1 : 0;
    worst_rad_ = std::max(worst_rad_, error);
  }

  void Report(Json& report) const {
    report["ippe_frames"] = single_;
    report["ippe_flipped"] = single_flipped_;
    report["mapped_frames"] = mapped_;
    report["mapped_flipped"] = mapped_flipped_;
    report["mapped_worst_deg"] = worst_rad_ * 180.0 / M_PI;
  }

 private:
  FlipCount(const KnownSquare& square, std::unique_ptr<MarkerDetector> detector)
      : square_(square), detector_(std::move(detector)) {}

  KnownSquare square_;
  std::unique_ptr<MarkerDetector> detector_;
  int single_ = 0, single_flipped_ = 0, mapped_ = 0, mapped_flipped_ = 0;
  double worst_rad_ = 0.0;
};

Trajectory TruthOf(const SquaresSource& source) {
  Trajectory truth;
  for (FrameId k = 0; k < *source.info().frame_count; ++k) {
    const double time_s = static_cast<double>(k) / source.info().camera->intrinsics().fps;
    truth.push_back(
        {static_cast<Timestamp>(std::llround(1e9 * time_s)), source.WorldFromCamera(k)});
  }
  return truth;
}

absl::Status WriteTruth(const Trajectory& truth, const std::filesystem::path& folder) {
  std::string text = "# timestamp tx ty tz qx qy qz qw   (camera in world, metres)\n";
  for (const StampedPose& pose : truth) {
    text += TumLine(absl::StrFormat("%.9f", Seconds(pose.time_ns)), pose.world_from_camera);
  }
  return WriteFileAtomically(folder / "groundtruth.txt", text);
}

TrackerArguments ArgumentsFor(const LandmarksScenario& scenario, const TrackerArguments& given,
                              const SquaresSource& source, const std::filesystem::path& map) {
  TrackerArguments arguments = given;
  std::vector<std::string> set;
  const KnownSquare& first = source.squares().squares.front();
  set.push_back(absl::StrCat("tracker=", scenario.tracker));
  if (scenario.motion == HallMotion::kFlip) {
    set.push_back(absl::StrCat("landmarks.family=", first.family));
    set.push_back(absl::StrCat("landmarks.size_m=", first.side_m));
  } else {
    set.push_back(absl::StrCat("landmarks.file=", map.string()));
  }
  arguments.set.insert(arguments.set.begin(), set.begin(), set.end());
  return arguments;
}

/// What somebody has measured of the hall: its pillar.
std::shared_ptr<const Sight> SightOfPillar(const SquaresSource& source) {
  const Eigen::AlignedBox3d box = source.ThingAt(0);
  TriangleMesh mesh;
  Append(BoxMesh(box.sizes(), 0xffffffff),
         {Eigen::Quaterniond::Identity(), {box.center().x(), box.max().y(), box.center().z()}}, 1.0,
         mesh);
  return std::make_shared<const Sight>(std::vector<TriangleMesh>{mesh});
}

absl::StatusOr<Json> RunOne(const LandmarksScenario& scenario, const SimArguments& arguments,
                            const std::filesystem::path& folder) {
  HallOptions hall;
  hall.seed = arguments.seed;
  hall.motion = scenario.motion;
  hall.duration_s = arguments.duration_s;
  hall.width = scenario.width;
  hall.height = scenario.height;
  hall.fps = scenario.fps;
  absl::StatusOr<std::unique_ptr<SquaresSource>> made = SquaresSource::Create(hall);
  if (!made.ok()) return made.status();
  SquaresSource& source = **made;
  if (const absl::Status status = CreateFolder(folder); !status.ok()) return status;
  const std::filesystem::path map = folder / "landmarks.toml";
  if (const absl::Status status = WriteFileAtomically(map, source.squares().ToToml());
      !status.ok()) {
    return status;
  }
  const Trajectory truth = TruthOf(source);
  if (const absl::Status status = WriteTruth(truth, folder); !status.ok()) return status;
  const TrackerArguments setup = ArgumentsFor(scenario, arguments.tracker, source, map);
  absl::StatusOr<std::unique_ptr<FrameTracker>> tracker = MakeFrameTracker(source.info(), setup);
  if (!tracker.ok()) return tracker.status();
  if (scenario.motion == HallMotion::kPillar) (*tracker)->SetSight(SightOfPillar(source));
  absl::StatusOr<OutputFile> squares = OutputFile::Create(folder / "squares.csv");
  if (!squares.ok()) return squares.status();
  HallWatch watch(source, *std::move(squares));
  absl::StatusOr<FlipCount> flips = FlipCount::Create(source.squares().squares.front());
  if (!flips.ok()) return flips.status();
  const auto* koller = dynamic_cast<const LandmarkTracker*>(tracker->get());
  const auto* fused = dynamic_cast<const Tracker*>(tracker->get());
  const auto track = [&](const Frame& frame) {
    std::shared_ptr<const MapSnapshot> snapshot = (*tracker)->Track(frame);
    watch.Add(frame, *snapshot);
    if (koller != nullptr) {
      watch.AddDetector(koller->detector_ms());
      std::vector<FeatureState> corners;
      for (const FeatureSnapshot& feature : snapshot->features) corners.push_back(feature.state);
      watch.AddSquares(frame.id, corners);
    }
    if (fused != nullptr && fused->squares() != nullptr) {
      watch.AddDetector(fused->squares()->detector_ms());
      if (scenario.motion != HallMotion::kFlip) {
        watch.AddSquares(frame.id, fused->squares()->StatesOfKnown());
      }
    }
    if (scenario.motion == HallMotion::kFlip) {
      std::optional<Rigid3> mapped;
      const KnownSquare& square = source.squares().squares.front();
      if (fused != nullptr && fused->squares() != nullptr) {
        mapped = fused->squares()->PoseOf(square.family, square.id, fused->filter());
      }
      flips->Add(frame, source.WorldFromCamera(frame.id), snapshot->world_from_camera, mapped);
    }
    return snapshot;
  };
  absl::StatusOr<Json> report = RunTracker(source, track, truth, folder);
  if (!report.ok()) return report;
  watch.Report(scenario.motion, *report);
  if (scenario.motion == HallMotion::kFlip) flips->Report(*report);
  if (const absl::Status closed = watch.Close(); !closed.ok()) return closed;
  return report;
}

}  // namespace

bool IsLandmarksScenario(absl::string_view name) { return Find(name) != nullptr; }

std::string LandmarksScenarioNames() { return "squares, pillar, passer, flip, away"; }

double LandmarksDuration_s(absl::string_view name) { return Find(name)->duration_s; }

absl::StatusOr<Json> RunLandmarksScenario(const SimArguments& arguments) {
  const LandmarksScenario& scenario = *Find(arguments.scenario);
  Json report;
  report["scenario"] = arguments.scenario;
  report["runs"] = arguments.runs;
  report["per_run"] = Json::array();
  for (int run = 0; run < arguments.runs; ++run) {
    SimArguments one = arguments;
    one.seed += static_cast<std::uint64_t>(run);
    absl::StatusOr<Json> result =
        RunOne(scenario, one, arguments.out / absl::StrFormat("run-%03d", run));
    if (!result.ok()) return result.status();
    Json each;
    each["seed"] = one.seed;
    each.update(*result);
    std::cerr << absl::StrCat("seed ", one.seed, ": ", each.dump(), "\n");
    if (arguments.runs == 1) report.update(each);
    report["per_run"].push_back(std::move(each));
  }
  return report;
}

}  // namespace saccade
