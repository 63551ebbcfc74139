#include "server/eval/reloc_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <iostream>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "server/capture/dataset.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/run.hpp"
#include "server/eval/statistics.hpp"
#include "server/eval/still_camera.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kAway_m = 0.30, kAway_rad = 20.0 * std::numbers::pi / 180.0;
constexpr double kRight_m = 0.03, kRight_rad = 1.0 * std::numbers::pi / 180.0;  // T18
constexpr double kWrong_m = 0.10, kWrong_rad = 5.0 * std::numbers::pi / 180.0;  // a false place
constexpr double kStart_s = 2.0;             // of the path: the map begins here
constexpr int kLooks = 12;                   // frames that a pose is looked at from
constexpr double kBorder_px = 20.0;          // nearer to the edge a feature is not recognised
constexpr int kForeignPerPose = 5;           // pictures
constexpr int kPerRoom = 50;                 // pictures of one other room
constexpr int kMostBlind = 90;               // covered frames until it must be lost
constexpr std::uint64_t kOtherRooms = 1000;  // seeds of other rooms begin after it

/// Feeds pictures to one tracker, 30 a second.
class Feeder {
 public:
  Feeder(TrackFunction track, const Frame& last) : track_(std::move(track)), frame_(last) {}

  std::shared_ptr<const MapSnapshot> Look(const cv::Mat& grey) {
    ++frame_.id;
    frame_.capture_time_ns += 33'333'333;
    frame_.grey = grey;
    frame_.color = cv::Mat();
    return track_(frame_);
  }
  /// Covers the lens until tracking is lost.
  absl::Status Lose() {
    const cv::Mat dark(frame_.grey.rows, frame_.grey.cols, CV_8UC1, cv::Scalar(16));
    for (int k = 0; k < kMostBlind; ++k) {
      if (Look(dark)->status == TrackingStatus::kLost) return absl::OkStatus();
    }
    return absl::FailedPreconditionError(
        absl::StrCat("reloc: still not lost after ", kMostBlind, " covered frames"));
  }

 private:
  TrackFunction track_;
  Frame frame_;
};

/// What became of one look at the mapped room; crosses a pipe as bytes.
struct Trial {
  int frames = -1;     // until the pose was published; -1: never
  int recognised = 0;  // times that a place was recognised and then put to the proof
  double position_m = 0, rotation_rad = 0;
  double slowest_ms = 0;            // frame
  double away_m = 0, away_rad = 0;  // from the moment of the path that it was drawn about
  int in_view = 0;                  // features of known depth that its picture could show
};

/// Runs `work` in a copy of this process, so that every trial starts from the same tracker.
absl::StatusOr<Trial> InCopy(const std::function<Trial()>& work) {
  int ends[2];
  if (pipe(ends) != 0) return absl::ResourceExhaustedError("reloc: no pipe; too many open files?");
  const pid_t child = fork();
  if (child < 0) return absl::ResourceExhaustedError("reloc: cannot fork; too little memory?");
  if (child == 0) {
    const Trial trial = work();
    const auto written = write(ends[1], &trial, sizeof(trial));
    _exit(written == sizeof(trial) ? 0 : 1);
  }
  close(ends[1]);
  Trial trial;
  const auto got = read(ends[0], &trial, sizeof(trial));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (got != sizeof(trial) || status != 0) {
    return absl::InternalError("reloc: a trial ended without an answer");
  }
  return trial;
}

/// The map that everything starts from, and the way it was made.
struct Mapped {
  std::unique_ptr<Tracker> tracker;
  TrackFunction Track() const {
    return [tracker = tracker.get()](const Frame& frame) { return tracker->Track(frame); };
  }
  Frame last;
  std::vector<Rigid3> path;             // true poses from kStart_s on
  std::vector<Eigen::Vector3d> points;  // of features whose depth is known, at the end
  std::size_t tracked = 0, frames = 0, features = 0;
};

absl::StatusOr<Mapped> MakeMap(const SimArguments& arguments) {
  SimOptions options;
  options.seed = arguments.seed;
  options.duration_s = arguments.duration_s;
  const absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::Open(options);
  if (!source.ok()) return source.status();
  absl::StatusOr<std::unique_ptr<Tracker>> tracker =
      MakeTracker((*source)->info(), arguments.tracker);
  if (!tracker.ok()) return tracker.status();
  Mapped mapped;
  mapped.tracker = *std::move(tracker);
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = (*source)->Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    const auto snapshot = mapped.tracker->Track(**frame);
    ++mapped.frames;
    mapped.tracked += snapshot->status == TrackingStatus::kTracking ? 1 : 0;
    mapped.features = snapshot->features.size();
    mapped.points.clear();
    for (const FeatureSnapshot& feature : snapshot->features) {
      if (feature.depth_known) mapped.points.push_back(feature.point_in_world);
    }
    if (Seconds((*frame)->capture_time_ns) >= kStart_s) {
      mapped.path.push_back((*source)->WorldFromCamera((*frame)->id));
    }
    mapped.last = **std::move(frame);
  }
  mapped.tracker->WaitForBackground();
  if (mapped.path.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("reloc: --duration must be above ", kStart_s, " s"));
  }
  return mapped;
}

Eigen::Vector3d InBall(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  while (true) {
    const double x = unit(rng), y = unit(rng), z = unit(rng);
    const Eigen::Vector3d v(x, y, z);
    if (v.squaredNorm() <= 1.0 && v.squaredNorm() > 1e-6) return v;
  }
}

/// Somewhere within 30 cm and 20 deg of the path, and the moment of the path it was drawn about.
std::pair<Rigid3, Rigid3> NearPath(const std::vector<Rigid3>& path, const StillCamera& camera,
                                   std::mt19937_64& rng) {
  for (int tries = 0;; ++tries) {
    const Rigid3 on_path = path[rng() % path.size()];
    Rigid3 pose = on_path;
    if (tries == 1000) return {pose, on_path};  // a path along walls: then from where it was
    pose.translation += kAway_m * InBall(rng);
    const Eigen::Vector3d axis = InBall(rng).normalized();
    const double angle = kAway_rad * std::uniform_real_distribution<double>(0.0, 1.0)(rng);
    pose.rotation = (pose.rotation * ExpQuaternion(angle * axis)).normalized();
    if (camera.Clear(pose)) return {pose, on_path};
  }
}

absl::StatusOr<std::vector<Trial>> RunTrials(const SimArguments& arguments, const Mapped& mapped) {
  absl::StatusOr<StillCamera> camera = StillCamera::Create(arguments.seed);
  if (!camera.ok()) return camera.status();
  std::mt19937_64 rng(arguments.seed * 77 + 5);
  std::vector<Trial> trials;
  for (int k = 0; k < arguments.runs; ++k) {
    const auto [truth, on_path] = NearPath(mapped.path, *camera, rng);
    std::vector<cv::Mat> pictures;
    for (int look = 0; look < kLooks; ++look) {
      absl::StatusOr<cv::Mat> picture =
          camera->Take(truth, static_cast<std::uint64_t>(k * kLooks + look));
      if (!picture.ok()) return picture.status();
      pictures.push_back(*std::move(picture));
    }
    absl::StatusOr<Trial> trial = InCopy([&, &truth = truth]() -> Trial {
      Feeder feeder(mapped.Track(), mapped.last);
      Trial result;
      if (!feeder.Lose().ok()) return result;
      TrackingStatus before = TrackingStatus::kLost;
      for (int look = 0; look < kLooks; ++look) {
        const Timestamp begin = MonotonicNow();
        const auto snapshot = feeder.Look(pictures[static_cast<std::size_t>(look)]);
        result.slowest_ms = std::max(result.slowest_ms, 1e3 * Seconds(MonotonicNow() - begin));
        result.recognised += snapshot->status == TrackingStatus::kRelocalising &&
                                     before != TrackingStatus::kRelocalising
                                 ? 1
                                 : 0;
        before = snapshot->status;
        if (before != TrackingStatus::kTracking) continue;
        result.frames = look + 1;
        result.position_m = (snapshot->world_from_camera.translation - truth.translation).norm();
        result.rotation_rad = RotationAngle(snapshot->world_from_camera, truth);
        break;
      }
      return result;
    });
    if (!trial.ok()) return trial.status();
    trial->away_m = (truth.translation - on_path.translation).norm();
    trial->away_rad = RotationAngle(truth, on_path);
    for (const Eigen::Vector3d& point : mapped.points) {
      const auto pixel = mapped.last.camera->Project(truth.Inverse() * point);
      trial->in_view += pixel && mapped.last.camera->InImage(*pixel, kBorder_px) ? 1 : 0;
    }
    trials.push_back(*trial);
  }
  return trials;
}

/// Pictures of other places, one after the other, to a tracker that is lost.
class ForeignLooks {
 public:
  explicit ForeignLooks(const Mapped& mapped) : feeder_(mapped.Track(), mapped.last) {}

  absl::Status Begin() { return feeder_.Lose(); }
  /// Each picture is looked at twice: a lost tracker asks at every second frame.
  absl::Status Look(const cv::Mat& grey) {
    ++pictures_;
    bool taken = false, published = false;
    for (int k = 0; k < 2; ++k) {
      const TrackingStatus status = feeder_.Look(grey)->status;
      taken |= status != TrackingStatus::kLost;
    }
    for (int k = 0; taken && k < kLooks; ++k) {
      published |= feeder_.Look(grey)->status == TrackingStatus::kTracking;
    }
    accepted_ += taken ? 1 : 0;
    published_ += published ? 1 : 0;
    return taken ? feeder_.Lose() : absl::OkStatus();
  }
  int pictures() const { return pictures_; }
  int accepted() const { return accepted_; }
  int published() const { return published_; }

 private:
  Feeder feeder_;
  int pictures_ = 0, accepted_ = 0, published_ = 0;
};

/// Recordings first (at most half), then rooms of other seeds; the target, which hangs in all of
/// them, is kept out of view.
absl::Status LookElsewhere(const SimArguments& arguments, const Mapped& mapped,
                           ForeignLooks& looks) {
  const int wanted = kForeignPerPose * arguments.runs;
  const auto folders = static_cast<int>(arguments.foreign.size());
  const cv::Size size = mapped.last.grey.size();
  for (const std::filesystem::path& folder : arguments.foreign) {
    const auto source = OpenDataset(folder, {});
    if (!source.ok()) return source.status();
    const int share = std::max(1, wanted / 2 / folders);
    const auto count = static_cast<int>((*source)->info().frame_count.value_or(1));
    const int step = std::max(1, count / share);
    for (int k = 0;; ++k) {
      const absl::StatusOr<std::optional<Frame>> frame = (*source)->Next();
      if (!frame.ok()) return frame.status();
      if (!*frame) break;
      if (k % step != 0 || k / step >= share) continue;
      cv::Mat grey;
      cv::resize((*frame)->grey, grey, size, 0, 0, cv::INTER_AREA);
      if (const absl::Status status = looks.Look(grey); !status.ok()) return status;
    }
  }
  std::mt19937_64 rng(arguments.seed * 91 + 3);
  for (std::uint64_t room = 1; looks.pictures() < wanted; ++room) {
    absl::StatusOr<StillCamera> camera = StillCamera::Create(kOtherRooms + arguments.seed + room);
    if (!camera.ok()) return camera.status();
    for (int k = 0; k < kPerRoom && looks.pictures() < wanted;) {
      // Anywhere in the room, in any direction that people look.
      std::uniform_real_distribution<double> unit(-1.0, 1.0);
      const double x = unit(rng), y = unit(rng), z = unit(rng);
      Rigid3 pose = ShoulderFromCamera(
          {std::numbers::pi * unit(rng), 0.6 * unit(rng) - 0.2, 0.15 * unit(rng)});
      pose.translation = WorldFromRoom() * Eigen::Vector3d(2 + 1.6 * x, 1.4 + 0.4 * y, 2 + 1.6 * z);
      if (!camera->Clear(pose) || camera->SeesTarget(pose)) continue;
      const absl::StatusOr<cv::Mat> picture = camera->Take(pose, static_cast<std::uint64_t>(k));
      if (!picture.ok()) return picture.status();
      if (const absl::Status status = looks.Look(*picture); !status.ok()) return status;
      ++k;
    }
  }
  return absl::OkStatus();
}

std::string TrialTable(const std::vector<Trial>& trials) {
  std::string text =
      "pose,away_m,away_deg,features_in_view,recognised,frames,position_error_m,rotation_error_"
      "deg\n";
  for (std::size_t k = 0; k < trials.size(); ++k) {
    const Trial& trial = trials[k];
    absl::StrAppendFormat(&text, "%d,%.3f,%.2f,%d,%d,%d,%.4f,%.3f\n", k, trial.away_m,
                          trial.away_rad * kDegrees, trial.in_view, trial.recognised, trial.frames,
                          trial.position_m, trial.rotation_rad * kDegrees);
  }
  return text;
}

Json TrialReport(const std::vector<Trial>& trials) {
  Sample metres, degrees, waits_ms, slowest_ms;
  int found = 0, recognised = 0, right = 0, wrong = 0;
  for (const Trial& trial : trials) {
    slowest_ms.Add(trial.slowest_ms);
    recognised += trial.recognised > 0 ? 1 : 0;
    if (trial.frames < 0) continue;
    ++found;
    right += trial.position_m <= kRight_m && trial.rotation_rad <= kRight_rad ? 1 : 0;
    wrong += trial.position_m > kWrong_m || trial.rotation_rad > kWrong_rad ? 1 : 0;
    metres.Add(trial.position_m);
    degrees.Add(trial.rotation_rad * kDegrees);
    waits_ms.Add(trial.frames * 1000.0 / 30.0);
  }
  Json report;
  report["poses"] = trials.size();
  report["recognised"] = recognised;
  report["found"] = found;
  report["found_fraction"] = trials.empty() ? 0.0 : static_cast<double>(found) / trials.size();
  report["within_3_cm_and_1_deg"] = right;
  report["wrong_place"] = wrong;
  report["error_m"] = {
      {"median", metres.Percentile(50)}, {"p95", metres.Percentile(95)}, {"max", metres.Max()}};
  report["error_deg"] = {
      {"median", degrees.Percentile(50)}, {"p95", degrees.Percentile(95)}, {"max", degrees.Max()}};
  // From the first picture to the first published pose, three confirming frames included.
  report["wait_ms"] = {{"median", waits_ms.Percentile(50)}, {"p95", waits_ms.Percentile(95)}};
  report["slowest_frame_ms"] = {{"median", slowest_ms.Percentile(50)}, {"max", slowest_ms.Max()}};
  return report;
}

}  // namespace

absl::StatusOr<Json> RunRelocScenario(const SimArguments& arguments) {
  if (const absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  const absl::StatusOr<Mapped> mapped = MakeMap(arguments);
  if (!mapped.ok()) return mapped.status();
  std::cerr << absl::StrFormat("mapped: %d of %d frames tracked, %d features\n", mapped->tracked,
                               mapped->frames, mapped->features);
  const absl::StatusOr<std::vector<Trial>> trials = RunTrials(arguments, *mapped);
  if (!trials.ok()) return trials.status();
  Json report;
  report["scenario"] = "reloc";
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["mapped_frames"] = mapped->tracked;
  report["map_features"] = mapped->features;
  report.update(TrialReport(*trials));
  const absl::Status written =
      WriteFileAtomically(arguments.out / "poses.csv", TrialTable(*trials));
  if (!written.ok()) return written;
  ForeignLooks looks(*mapped);
  if (const absl::Status status = looks.Begin(); !status.ok()) return status;
  if (const absl::Status status = LookElsewhere(arguments, *mapped, looks); !status.ok()) {
    return status;
  }
  report["foreign_pictures"] = looks.pictures();
  report["foreign_accepted"] = looks.accepted();
  report["foreign_published"] = looks.published();
  return report;
}

}  // namespace saccade
