#include "server/eval/gaze_run.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "server/eval/outline.hpp"
#include "server/eval/registration.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

Timestamp Ns(double seconds) { return static_cast<Timestamp>(std::llround(1e9 * seconds)); }

}  // namespace

absl::StatusOr<std::unique_ptr<GazeRun>> GazeRun::Create(const GazeRunOptions& options) {
  if (const absl::Status valid = options.mount.mount.Validate(); !valid.ok()) return valid;
  if (const absl::Status valid = options.gaze.Validate(); !valid.ok()) return valid;
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::Open(options.sim);
  if (!source.ok()) return source.status();
  auto mount = std::make_shared<SimMount>(options.mount);
  (*source)->DriveHead(mount);
  SourceInfo info = (*source)->info();
  if (!options.encoders) info.mount = nullptr;
  absl::StatusOr<std::unique_ptr<Wearable>> wearable = MakeWearable(info, options.tracker);
  if (!wearable.ok()) return wearable.status();
  absl::StatusOr<RunRecorder> recorder = RunRecorder::Create(options.folder);
  if (!recorder.ok()) return recorder.status();
  absl::StatusOr<OutputFile> truth = OutputFile::Create(options.folder / "groundtruth.txt");
  if (!truth.ok()) return truth.status();
  absl::StatusOr<OutputFile> gaze = OutputFile::Create(options.folder / "gaze.csv");
  if (!gaze.ok()) return gaze.status();
  absl::StatusOr<OutputFile> looks = OutputFile::Create(options.folder / "looks.csv");
  if (!looks.ok()) return looks.status();
  return std::unique_ptr<GazeRun>(
      new GazeRun(options, *std::move(source), std::move(mount), *std::move(wearable),
                  *std::move(recorder), *std::move(truth), *std::move(gaze), *std::move(looks)));
}

GazeRun::GazeRun(const GazeRunOptions& options, std::unique_ptr<SimSource> source,
                 std::shared_ptr<SimMount> mount, std::unique_ptr<Wearable> wearable,
                 RunRecorder recorder, OutputFile truth_file, OutputFile gaze_file,
                 OutputFile looks_file)
    : options_(options),
      mount_(std::move(mount)),
      source_(std::move(source)),
      wearable_(std::move(wearable)),
      recorder_(std::move(recorder)),
      truth_file_(std::move(truth_file)),
      gaze_file_(std::move(gaze_file)),
      looks_file_(std::move(looks_file)),
      loop_(std::make_unique<GazeLoop>(*mount_, options.gaze, [] { return "evaluation"; })) {
  mount_->AdvanceTo(0);
  looks_file_.Write(
      "time_s,annotation,arrived_after_s,true_error_deg,believed_error_deg,anchor_off_across_cm,"
      "anchor_off_along_cm,anchor_off_deg\n");
  truth_file_.Write("# timestamp tx ty tz qx qy qz qw   (camera in world, metres)\n");
  gaze_file_.Write(
      "time_s,mode,pan_deg,elevation_deg,cyclotorsion_deg,believed_error_deg,true_roll_deg\n");
}

std::optional<Annotation> GazeRun::Find(const std::string& id) const {
  const auto annotations = wearable_->annotations();  // held: the next frame replaces the list
  for (const Annotation& each : *annotations) {
    if (each.id == id) return each;
  }
  return std::nullopt;
}

std::optional<double> GazeRun::Way_deg(const std::string& id) const {
  const std::optional<Annotation> target = Find(id);
  const std::optional<Rigid3> base = loop_->controller().WorldFromMount(now_ns_);
  if (!target || !base) return std::nullopt;
  const MountAngles now = mount_->TrueAngles(now_ns_);
  const MountAngles there =
      mount_->model()
          .Fixate(base->Inverse() * target->anchor.point_in_world, std::nullopt, now)
          .angles;
  return (ToVector(there) - ToVector(now)).cwiseAbs().maxCoeff() / kDegree;
}

absl::Status GazeRun::WriteClicks() const {
  std::string text =
      "time_s,annotation,object,range_m,placed_off_cm,claimed_cm,now_off_cm,"
      "now_claimed_cm\n";
  for (const PlacedClick& click : clicks_) {
    const auto off = [&](const Annotation& each) {
      return each.anchor.point_in_world - click.clicked.true_point;
    };
    const std::optional<Annotation> now = Find(click.clicked.id);
    const double range = (click.clicked.true_point - click.world_from_camera.translation).norm();
    std::string object;  // as the room calls it
    for (const NamedPoint& each : source_->objects()) {
      if (each.point_in_world == click.clicked.true_point) object = each.name;
    }
    absl::StrAppendFormat(&text, "%.2f,%s,%s,%.2f,%.2f,%.2f,", click.time_s,
                          click.clicked.id.substr(click.clicked.id.size() - 4), object, range,
                          100 * off(click.placed).norm(), 100 * click.placed.anchor.error_m);
    if (now) {
      absl::StrAppendFormat(&text, "%.2f,%.2f\n", 100 * off(*now).norm(),
                            100 * now->anchor.error_m);
    } else {
      text += ",\n";
    }
  }
  return WriteFileAtomically(options_.folder / "clicks.csv", text);
}

void GazeRun::WriteLook(const Clicked& target, double begin_s, std::optional<double> arrival_s) {
  const std::optional<Annotation> placed = Find(target.id);
  if (!placed) return;
  const Eigen::Vector3d off = placed->anchor.point_in_world - target.true_point;
  const Eigen::Vector3d line = target.true_point - TrueCamera().translation;
  const double range = line.norm(), along = off.dot(line) / range;
  const double across = std::sqrt(std::max(0.0, off.squaredNorm() - along * along));
  const auto& believed = loop_->snapshot()->error_rad;
  looks_file_.Write(absl::StrFormat(
      "%.2f,%s,%s,%.3f,%s,%.2f,%.2f,%.3f\n", begin_s, target.id.substr(target.id.size() - 4),
      arrival_s ? absl::StrFormat("%.2f", *arrival_s) : "", TrueError_deg(target.true_point),
      believed ? absl::StrFormat("%.3f", *believed / kDegree) : "", 100 * across, 100 * along,
      std::atan2(across, range) / kDegree));
}

absl::Status GazeRun::RunUntil(double time_s, const std::function<void()>& tick) {
  const Timestamp step = Ns(1.0 / options_.control_hz);
  while (now_ns_ < Ns(time_s)) {
    now_ns_ += step;
    mount_->AdvanceTo(now_ns_);
    // A picture can be taken once the head has moved, and its encoders have spoken, past it.
    while (!ended_ &&
           Seconds(now_ns_) > static_cast<double>(next_frame_) / options_.sim.fps + 0.02) {
      if (const absl::Status taken = TakeFrame(); !taken.ok()) return taken;
    }
    Control();
    tick();
  }
  return gaze_file_.status();
}

void GazeRun::Control() {
  while (!due_.empty() && due_.front().publish_ns <= now_ns_) {
    loop_->OnView(due_.front().view);
    due_.pop_front();
  }
  loop_->Step(now_ns_);
  const Eigen::Vector3d joints = ToVector(mount_->TrueAngles(now_ns_));
  if (last_joints_) {
    const double rate = (joints - *last_joints_).cwiseAbs().maxCoeff() * options_.control_hz;
    peak_rate_deg_s_ = std::max(peak_rate_deg_s_, rate / kDegree);
  }
  last_joints_ = joints;
  const GazeSnapshot& state = *loop_->snapshot();
  gaze_file_.Write(absl::StrFormat(
      "%.3f,%s,%.3f,%.3f,%.3f,%s,%.3f\n", time_s(), ToString(state.mode), joints.x() / kDegree,
      joints.y() / kDegree, joints.z() / kDegree,
      state.error_rad ? absl::StrFormat("%.3f", *state.error_rad / kDegree) : "", TrueRoll_deg()));
}

absl::Status GazeRun::TakeFrame() {
  absl::StatusOr<std::optional<Frame>> taken = source_->Next();
  if (!taken.ok()) return taken.status();
  if (!*taken) {
    ended_ = true;
    return absl::OkStatus();
  }
  Frame frame = **std::move(taken);
  next_frame_ = frame.id + 1;
  const std::optional<MountAngles> read = frame.mount;
  if (!options_.encoders) frame.mount.reset();
  const WearableStep& step = wearable_->Step(std::move(frame));
  newest_ = step.snapshot;
  due_.push_back({.publish_ns = step.frame->capture_time_ns + Ns(options_.delay_s),
                  .view = wearable_->View(read)});
  return Record(*step.frame, step.cost);
}

absl::Status GazeRun::Record(const Frame& frame, const FrameCost& cost) {
  const Rigid3 truth = source_->WorldFromCamera(frame.id);
  truth_.push_back({frame.capture_time_ns, truth});
  truth_file_.Write(TumLine(absl::StrFormat("%.9f", Seconds(frame.capture_time_ns)), truth));
  FrameVerdict verdict = VerdictOf(*newest_);
  const bool posed = verdict == FrameVerdict::kTracked || verdict == FrameVerdict::kCoasting;
  claims_.Observe({Seconds(frame.capture_time_ns), posed, newest_->metric, frame.camera.get(),
                   newest_->world_from_camera, truth},
                  *wearable_->annotations(),
                  [&](const Eigen::Vector3d& point) { return source_->Visible(frame.id, point); });
  if (posed && IsLost(newest_->world_from_camera, truth)) verdict = FrameVerdict::kLost;
  if (verdict != FrameVerdict::kInitialising) {
    measured_.Add(newest_->matched);
    if (newest_->searched_px2 > 0 && newest_->attempted > 0) {
      searched_px2_.Add(newest_->searched_px2 / newest_->attempted);
    }
  }
  if (const absl::Status added = recorder_.Add(frame, *newest_, cost, verdict); !added.ok()) {
    return added;
  }
  return truth_file_.status();
}

absl::StatusOr<GazeRun::Clicked> GazeRun::Click(const std::optional<Eigen::Vector3d>& object) {
  if (newest_ == nullptr) return absl::FailedPreconditionError("no frame yet");
  const FrameId frame = newest_frame();
  const CameraModel& camera = *source_->info().camera;
  Eigen::Vector2d pixel(0.5 * camera.width(), 0.5 * camera.height());
  if (object) {
    const std::optional<Eigen::Vector2d> at = source_->PixelOf(frame, *object);
    if (!at || !camera.InImage(*at, 30) || !source_->Visible(frame, *object)) {
      return absl::NotFoundError("the object is not in view");
    }
    pixel = *at;
  }
  const std::optional<Eigen::Vector3d> point = object ? object : source_->PointAt(frame, pixel);
  if (!point) return absl::NotFoundError("there is no surface");
  const absl::StatusOr<Annotation> placed =
      PlaceAsExpert(*wearable_, PixelTarget{frame, pixel}, ++requests_);
  if (!placed.ok()) return placed.status();
  // Gaze control learns of it at once, as it would from the server's mailbox.
  for (Due& due : due_) due.view.annotations = wearable_->annotations();
  loop_->OnView(wearable_->View(std::nullopt));  // without angles: no pose before its time
  const Clicked clicked{placed->id, *point};
  const Rigid3 eye = source_->WorldFromCamera(frame);
  clicks_.push_back({time_s(), clicked, *placed, eye});
  claims_.Place({clicked.id, requests_, time_s(), pixel, (*point - eye.translation).norm(),
                 IsOnOutline(*source_, eye.translation, *point), *point});
  return clicked;
}

double GazeRun::TrueError_deg(const Eigen::Vector3d& point_in_world) const {
  const Eigen::Vector3d seen = TrueCamera().Inverse() * point_in_world;
  return std::atan2(seen.head<2>().norm(), seen.z()) / kDegree;
}

double GazeRun::TrueRoll_deg() const {
  const Eigen::Vector3d down = TrueCamera().rotation.conjugate() * Eigen::Vector3d::UnitY();
  return std::atan2(-down.x(), down.y()) / kDegree;
}

GazeRun::DepthClaims GazeRun::CheckDepths() const {
  DepthClaims claims;
  if (newest_ == nullptr) return claims;
  const Eigen::Vector3d eye = source_->WorldFromCamera(newest_frame()).translation;
  for (const FeatureSnapshot& feature : newest_->features) {
    ++claims.total;
    if (!feature.depth_known) continue;
    if (!IsOnASurface(*source_, eye, feature.point_in_world)) ++claims.false_depth;
  }
  return claims;
}

absl::Status GazeRun::Close() {
  for (const absl::Status& status :
       {recorder_.Close(), truth_file_.Close(), gaze_file_.Close(), looks_file_.Close()}) {
    if (!status.ok()) return status;
  }
  return WriteClicks();
}

}  // namespace saccade
