#include "server/eval/pixel_run.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "server/eval/false_tracked.hpp"
#include "server/eval/outline.hpp"
#include "server/eval/registration.hpp"

namespace saccade {
namespace {

constexpr double kClickBorder_px = 40.0;  // nobody clicks the very edge
constexpr int kClickTries = 50;
constexpr double kOtherObject_m = 0.03;
constexpr double kMinDistance_m = 0.25;

std::string StampText(const Frame& frame) {
  return frame.source_timestamp.empty() ? absl::StrFormat("%.9f", Seconds(frame.capture_time_ns))
                                        : frame.source_timestamp;
}

}  // namespace

void PixelRunTotals::Add(const PixelRunTotals& other) {
  frames += other.frames;
  lost_frames += other.lost_frames;
  initialising_frames += other.initialising_frames;
  coasting_frames += other.coasting_frames;
  tracked_frames += other.tracked_frames;
  lost_after_start_frames += other.lost_after_start_frames;
  false_tracked_frames += other.false_tracked_frames;
  if (other.scale_windows) {
    ScaleWindows all = scale_windows.value_or(*other.scale_windows);
    all.min = std::min(all.min, other.scale_windows->min);
    all.max = std::max(all.max, other.scale_windows->max);
    all.windows = (scale_windows ? all.windows : 0) + other.scale_windows->windows;
    scale_windows = all;
  }
  anchors += other.anchors;
  refused_clicks += other.refused_clicks;
  views += other.views;
  tracking_views += other.tracking_views;
  drawn_views += other.drawn_views;
  squared_px.Add(other.squared_px);
  squared_mm_per_m.Add(other.squared_mm_per_m);
  frame_ms.Add(other.frame_ms);
  claims.Add(other.claims);
}

absl::StatusOr<PixelRun> PixelRun::Create(const SimOptions& options,
                                          const TrackerArguments& tracker, const ClickPlan& plan,
                                          bool targetless, const std::filesystem::path& folder) {
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::Open(options);
  if (!source.ok()) return source.status();
  SourceInfo info = (*source)->info();
  if (targetless) info.target.reset();
  absl::StatusOr<std::unique_ptr<Wearable>> wearable = MakeWearable(info, tracker);
  if (!wearable.ok()) return wearable.status();
  absl::StatusOr<RunRecorder> recorder = RunRecorder::Create(folder);
  if (!recorder.ok()) return recorder.status();
  absl::StatusOr<OutputFile> truth = OutputFile::Create(folder / "groundtruth.txt");
  if (!truth.ok()) return truth.status();
  absl::StatusOr<OutputFile> anchors = OutputFile::Create(folder / "anchors.csv");
  if (!anchors.ok()) return anchors.status();
  return PixelRun(*std::move(source), *std::move(wearable), *std::move(recorder), *std::move(truth),
                  *std::move(anchors), options, plan, folder);
}

PixelRun::PixelRun(std::unique_ptr<SimSource> source, std::unique_ptr<Wearable> wearable,
                   RunRecorder recorder, OutputFile truth_file, OutputFile anchors_file,
                   const SimOptions& options, const ClickPlan& plan,
                   const std::filesystem::path& folder)
    : source_(std::move(source)),
      wearable_(std::move(wearable)),
      recorder_(std::move(recorder)),
      truth_file_(std::move(truth_file)),
      anchors_file_(std::move(anchors_file)),
      plan_(plan),
      fps_(options.fps),
      rng_(options.seed),
      folder_(folder) {
  truth_file_.Write("# timestamp tx ty tz qx qy qz qw   (camera in world, metres)\n");
  anchors_file_.Write(
      "frame,anchor,state,drawn,true_u_px,true_v_px,error_px,error_mm_per_m,error_m,reported_error_"
      "m\n");
}

absl::StatusOr<std::optional<double>> PixelRun::Run(PixelRunTotals& totals) {
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = source_->Next();
    if (!frame.ok()) return frame.status();
    if (!*frame) break;
    if (const absl::Status status = Step(**frame, totals); !status.ok()) return status;
  }
  totals.frames += recorder_.frames();
  totals.lost_frames += recorder_.CountOf(FrameVerdict::kLost);
  totals.initialising_frames += recorder_.CountOf(FrameVerdict::kInitialising);
  totals.coasting_frames += recorder_.CountOf(FrameVerdict::kCoasting);
  totals.tracked_frames += recorder_.CountOf(FrameVerdict::kTracked);
  totals.lost_after_start_frames += recorder_.lost_after_start();
  totals.scale_windows = ScaleOfWindows(claimed_);
  totals.anchors += clicked_.size();
  for (const absl::Status& status :
       {recorder_.Close(), truth_file_.Close(), anchors_file_.Close()}) {
    if (!status.ok()) return status;
  }
  const absl::StatusOr<TrajectoryScore> score =
      Score(Associate(recorder_.trajectory(), truth_), TrajectoryAlignment::kSe3);
  const double scale = metric_ || !score.ok() ? 1.0 : score->scale;
  totals.claims.Add(claims_, scale);
  if (const absl::Status status = claims_.Write(folder_ / "claims.csv", scale); !status.ok()) {
    return status;
  }
  if (!score.ok()) return std::nullopt;
  return metric_ ? score->ate_se3_m : score->ate_sim3_m;
}

absl::Status PixelRun::Step(const Frame& frame, PixelRunTotals& totals) {
  const WearableStep& step = wearable_->Step(frame);
  const std::shared_ptr<const MapSnapshot>& snapshot = step.snapshot;
  totals.frame_ms.Add(step.cost.wall_ms);

  const Rigid3 truth = source_->WorldFromCamera(frame.id);
  truth_.push_back({frame.capture_time_ns, truth});
  truth_file_.Write(TumLine(StampText(frame), truth));
  FrameVerdict verdict = VerdictOf(*snapshot);
  const bool pose_published =
      verdict == FrameVerdict::kTracked || verdict == FrameVerdict::kCoasting;
  metric_ = snapshot->metric;
  if (verdict == FrameVerdict::kTracked) {
    const Rigid3& claimed = snapshot->world_from_camera;
    claimed_.push_back({frame.capture_time_ns, claimed, truth});
    const double error_m = (claimed.translation - truth.translation).norm();
    totals.false_tracked_frames += metric_ && !(error_m <= kFalseTracked_m) ? 1 : 0;
  }
  // Without metres the world is another one: nothing to compare with before the end.
  if (pose_published && metric_ && IsLost(snapshot->world_from_camera, truth)) {
    verdict = FrameVerdict::kLost;
  }
  if (const absl::Status status = recorder_.Add(frame, *snapshot, step.cost, verdict);
      !status.ok()) {
    return status;
  }
  ClickIfDue(frame.id, totals);
  WatchClaims(frame, *snapshot, pose_published);
  CompareAnchors(frame, *snapshot, pose_published, totals);
  return anchors_file_.status().ok() ? truth_file_.status() : anchors_file_.status();
}

void PixelRun::ClickIfDue(FrameId now, PixelRunTotals& totals) {
  const double time_s = static_cast<double>(now) / fps_;
  const double due_s = plan_.first_s + clicks_ * plan_.every_s;
  if (time_s < due_s || due_s > plan_.last_s) return;
  ++clicks_;
  const auto delay = static_cast<FrameId>(std::lround(plan_.delay_s * fps_));
  const FrameId seen = now > delay ? now - delay : 0;  // what the expert had on screen
  const std::optional<SurfacePixel> surface = PickSurface(seen);
  if (!surface) {
    ++totals.refused_clicks;
    return;
  }
  const absl::StatusOr<Annotation> placed =
      PlaceAsExpert(*wearable_, PixelTarget{seen, surface->pixel}, clicks_);
  if (!placed.ok()) {
    anchors_file_.Write(absl::StrCat("# click ", clicks_, " in frame ", seen,
                                     " refused: ", placed.status().message(), "\n"));
    ++totals.refused_clicks;
    return;
  }
  clicked_.push_back({placed->id, clicks_, surface->point_in_world});
  const Rigid3 eye = source_->WorldFromCamera(seen);
  claims_.Place({placed->id, clicks_, time_s, surface->pixel,
                 (surface->point_in_world - eye.translation).norm(),
                 IsOnOutline(*source_, eye.translation, surface->point_in_world),
                 surface->point_in_world});
}

std::optional<PixelRun::SurfacePixel> PixelRun::PickSurface(FrameId frame) {
  const CameraModel& camera = *source_->info().camera;
  // People click objects: one of those in view that were not clicked yet, else any surface.
  std::vector<SurfacePixel> objects;
  for (const SimObject& object : source_->Truth(frame).objects) {
    if (!object.visible || !object.pixel || !camera.InImage(*object.pixel, kClickBorder_px))
      continue;
    const bool again = std::any_of(clicked_.begin(), clicked_.end(), [&](const Clicked& before) {
      return (before.true_point - object.point_in_world).norm() < kOtherObject_m;
    });
    if (!again) objects.push_back({*object.pixel, object.point_in_world});
  }
  if (!objects.empty()) {
    return objects[std::uniform_int_distribution<std::size_t>(0, objects.size() - 1)(rng_)];
  }
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < kClickTries; ++i) {
    const Eigen::Vector2d pixel(
        kClickBorder_px + unit(rng_) * (camera.width() - 1 - 2 * kClickBorder_px),
        kClickBorder_px + unit(rng_) * (camera.height() - 1 - 2 * kClickBorder_px));
    const auto point = source_->PointAt(frame, pixel);
    if (!point || !source_->Visible(frame, *point)) continue;
    if ((source_->WorldFromCamera(frame).translation - *point).norm() < kMinDistance_m) continue;
    return SurfacePixel{pixel, *point};
  }
  return std::nullopt;
}

void PixelRun::WatchClaims(const Frame& frame, const MapSnapshot& snapshot, bool pose_published) {
  const ClaimFrame seen{static_cast<double>(frame.id) / fps_,
                        pose_published,
                        snapshot.metric,
                        frame.camera.get(),
                        snapshot.world_from_camera,
                        source_->WorldFromCamera(frame.id)};
  claims_.Observe(seen, *wearable_->annotations(),
                  [&](const Eigen::Vector3d& point) { return source_->Visible(frame.id, point); });
}

void PixelRun::CompareAnchors(const Frame& frame, const MapSnapshot& snapshot, bool pose_published,
                              PixelRunTotals& totals) {
  const auto latest = wearable_->annotations();
  for (const Clicked& clicked : clicked_) {
    const auto true_pixel = source_->PixelOf(frame.id, clicked.true_point);
    if (!true_pixel || !frame.camera->InImage(*true_pixel)) continue;
    if (!source_->Visible(frame.id, clicked.true_point)) continue;
    const Anchor* anchor = nullptr;
    for (const Annotation& annotation : *latest) {
      if (annotation.id == clicked.id) anchor = &annotation.anchor;
    }
    const AnchorState state = anchor != nullptr ? anchor->state : AnchorState::kStopped;
    const bool drawn = pose_published && anchor != nullptr && anchor->place_known &&
                       state != AnchorState::kStopped;  // paused: hollow
    const auto error = CompareRegistration(
        *frame.camera, source_->WorldFromCamera(frame.id), clicked.true_point,
        snapshot.world_from_camera, drawn ? std::optional(anchor->point_in_world) : std::nullopt);
    if (!error) continue;
    ++totals.views;
    totals.tracking_views += state == AnchorState::kTracking && pose_published ? 1 : 0;
    totals.drawn_views += drawn ? 1 : 0;
    totals.squared_px.Add(error->pixels * error->pixels);
    if (error->mm_per_m) totals.squared_mm_per_m.Add(*error->mm_per_m * *error->mm_per_m);
    anchors_file_.Write(absl::StrFormat(
        "%d,%d,%s,%d,%.2f,%.2f,%.3f,%s,%.5f,%.5f\n", frame.id, clicked.number, ToString(state),
        drawn ? 1 : 0, true_pixel->x(), true_pixel->y(), error->pixels,
        error->mm_per_m ? absl::StrFormat("%.3f", *error->mm_per_m) : "",
        anchor != nullptr ? (anchor->point_in_world - clicked.true_point).norm() : 0.0,
        anchor != nullptr ? anchor->error_m : 0.0));
  }
}

}  // namespace saccade
