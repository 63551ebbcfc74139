#pragma once

#include <memory>
#include <string>

#include "server/record/replayer.hpp"
#include "server/rpc/backend.hpp"

namespace saccade {

/// What services know of the engine, where a recording stands in its place: it is looked at, and
/// nothing of it changes (FailedPrecondition).
class ReplayBackend final : public Backend {
 public:
  /// `replayer` outlives it.
  ReplayBackend(Replayer& replayer, std::string version, std::string source)
      : replayer_(replayer), facts_{std::move(version), std::move(source), replayer.camera()} {}

  absl::Status Submit(Command command) override;
  const ServerFacts& facts() const override { return facts_; }
  std::shared_ptr<const AnnotationList> annotations() const override {
    return replayer_.annotations();
  }
  std::shared_ptr<const GazeSnapshot> gaze() const override { return replayer_.gaze(); }
  std::shared_ptr<const SurfaceSnapshot> surface() const override { return replayer_.surface(); }
  absl::Status SubmitGaze(GazeCommand command) override;
  void GetStill(std::optional<FrameId> frame_id, VideoView view, Done<Still> done) override;
  absl::StatusOr<std::vector<Eigen::Vector3d>> LocatePointer(
      absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>* surface) override;
  void SetPointers(std::shared_ptr<const PointerList> /*pointers*/) override {}
  void ReadPicture(std::string bytes, Done<PicturePtr> done) override;
  void SetPresence(std::shared_ptr<const ParticipantSet> /*present*/) override {}
  void SetVideoDemand(VideoView /*view*/, bool /*wanted*/) override {}
  void RequestKeyFrame(VideoView view) override;
  void PausePicture(bool paused, std::string by, Done<PicturePause> done) override;
  std::shared_ptr<const PicturePause> picture_pause() const override { return pause_; }
  std::shared_ptr<const Scene> scene() const override { return scene_; }
  absl::Status SubmitScene(SceneCommand command) override;

 private:
  Replayer& replayer_;
  const ServerFacts facts_;
  const std::shared_ptr<const PicturePause> pause_ = std::make_shared<const PicturePause>();
  const std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>();
};

}  // namespace saccade
