#include "server/app/replay_backend.hpp"

namespace saccade {
namespace {

absl::Status OnlyReplayed() {
  return absl::FailedPreconditionError("this is a recording: nothing of it can be changed");
}

}  // namespace

absl::Status ReplayBackend::Submit(Command command) {
  // Whose session ends has nothing to be undone here.
  return std::holds_alternative<ForgetPerson>(command) ? absl::OkStatus() : OnlyReplayed();
}

absl::Status ReplayBackend::SubmitGaze(GazeCommand /*command*/) { return OnlyReplayed(); }

void ReplayBackend::GetStill(std::optional<FrameId> /*frame_id*/, VideoView /*view*/,
                             Done<Still> done) {
  done(absl::FailedPreconditionError("this is a recording: it holds no stills"));
}

absl::StatusOr<std::vector<Eigen::Vector3d>> ReplayBackend::LocatePointer(
    absl::Span<const AnnotationTarget> /*points*/, std::optional<StrokeSurface>* /*surface*/) {
  return OnlyReplayed();
}

void ReplayBackend::ReadPicture(std::string /*bytes*/, Done<PicturePtr> done) {
  done(OnlyReplayed());
}

void ReplayBackend::RequestKeyFrame(VideoView view) {
  if (view == VideoView::kRaw) replayer_.ShowAgain();
}

void ReplayBackend::PausePicture(bool /*paused*/, std::string /*by*/, Done<PicturePause> done) {
  done(OnlyReplayed());
}

absl::Status ReplayBackend::SubmitScene(SceneCommand /*command*/) { return OnlyReplayed(); }

}  // namespace saccade
