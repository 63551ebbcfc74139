// What the engine shows, and when it shows nothing.
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "server/app/crop_view.hpp"
#include "server/app/engine.hpp"

namespace saccade {

void Engine::PausePicture(bool paused, std::string by, Done<PicturePause> done) {
  pictures_->Set(paused, std::move(by), std::move(done));
}

std::shared_ptr<const PicturePause> Engine::picture_pause() const { return pictures_->state(); }

std::shared_ptr<const Scene> Engine::scene() const { return scene_->scene(); }

absl::Status Engine::SubmitScene(SceneCommand command) {
  return scene_->Submit(std::move(command));
}

void Engine::OnPicturePause(const std::shared_ptr<const PicturePause>& state) {
  for (const auto& view : views_) view->AwaitFrame();
  sink_.OnPicturePause(state);
  if (state->paused) return;
  for (const auto& view : views_) view->RequestKeyFrame();
}

void Engine::GetStill(std::optional<FrameId> frame_id, VideoView view, Done<Still> done) {
  absl::StatusOr<PastFrame> past =
      frame_id ? wearable_->ring().Find(*frame_id) : wearable_->ring().Newest();
  if (!past.ok()) return done(past.status());
  if (absl::Status may = pictures_->MayShow(past->frame->id); !may.ok()) return done(may);
  wearable_->ring().Hold(*past);
  const absl::Status queued = stills_.Post({*std::move(past), view, done});
  if (!queued.ok()) done(queued);
}

void Engine::MakeStill(StillRequest request) {
  TrackedFrame frame{.frame = request.past.frame, .tracked = {}};
  frame.tracked.snapshot = request.past.snapshot;
  frame.tracked.camera = request.past.frame->camera;
  frame.tracked.annotations = wearable_->annotations();
  frame.tracked.stages.captured_ns = request.past.frame->received_time_ns;
  std::vector<uchar> png;
  try {
    const cv::Mat picture = request.view == VideoView::kAugmented
                                ? DrawAugmented(frame, /*waits=*/true)
                                : PictureOf(*frame.frame);
    // Level 1: a third of the time of the default for a tenth more bytes.
    cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
  } catch (const std::exception&) {  // no memory, or what OpenCV will not draw: said below
    png.clear();
  }
  // Meanwhile it may have been paused.
  const absl::Status may = pictures_->MayShow(request.past.frame->id);
  if (!may.ok()) return request.done(may);
  if (png.empty()) {
    return request.done(absl::InternalError("the picture could not be coded as PNG"));
  }
  request.done(Still{std::make_shared<const std::string>(png.begin(), png.end()), frame.tracked});
}

cv::Mat Engine::DrawAugmented(const TrackedFrame& frame, bool waits) const {
  OverlayOptions overlay = options_.overlay;
  const std::shared_ptr<const GazeSnapshot> state = gaze();
  if (state->target) {  // green
    if (const auto* feature = std::get_if<GazeFeature>(&*state->target)) {
      overlay.fixated_feature = feature->id;
    } else if (const auto* annotation = std::get_if<GazeAnnotation>(&*state->target)) {
      overlay.fixated_annotation = annotation->id;
    }
  }
  overlay.picture = [this, waits](const PicturePtr& one) {
    return waits ? gallery_.FindNow(one) : gallery_.Find(one);
  };
  {
    const std::lock_guard lock(pointers_mutex_);
    overlay.pointers = pointers_;
  }
  overlay.scene = [this, &frame](const CameraModel& camera, const Rigid3& world_from_camera) {
    const auto& markers = frame.tracked.markers;
    return scene_layer_.Draw(
        *scene_->scene(), *frame.tracked.annotations,
        markers ? std::span<const MarkerPose>(*markers) : std::span<const MarkerPose>(), camera,
        world_from_camera);
  };
  cv::Mat picture =
      Augment(*frame.frame, *frame.tracked.snapshot, *frame.tracked.annotations, overlay);
  if (options_.crop) {
    const Eigen::Quaterniond world_from_camera = frame.tracked.snapshot->world_from_camera.rotation;
    picture =
        CropView(picture, *frame.tracked.camera, *options_.crop,
                 state->world_from_view ? world_from_camera.conjugate() * *state->world_from_view
                                        : Eigen::Quaterniond::Identity());
  }
  if (state->guidance_rad) DrawGuidance(*state->guidance_rad, picture);
  return picture;
}

}  // namespace saccade
