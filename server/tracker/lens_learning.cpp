// The part of the tracker that learns the lens.
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

// What a change of lens leaves unknown of the camera, before this frame's matches are used again.
constexpr double kPositionShare = 0.01;  // of the distance to what is in view
constexpr double kAngleSigma_rad = 0.01;

}  // namespace

bool Tracker::StudiesLens() {
  if (!learner_ || !source_.target || !starter_.waits_for_target()) return false;
  const auto* board = std::get_if<ChessboardTarget>(&*source_.target);
  const ImagePyramid* picture = front_end_->pyramid();
  return board != nullptr && picture != nullptr && learner_->Study(*board, *picture);
}

void Tracker::LearnLens(const Frame& frame) {
  const std::shared_ptr<const CameraModel> before = learner_->lens();
  const auto job = learner_->Finish(frames_);
  times_.waited_ms += learner_->waited_ms();
  if (job) {
    refiner_.Drop(filter_);
    loops_.Reset();
    relocaliser_.Clear();  // its corners were placed through the lens before
    map_.TakeLens(*job, *before, learner_->lens(), filter_);
    last_frame_.camera = learner_->lens();
    const double unit = 1.0 / std::max(1e-6, depth_.inverse_range);
    Vector12d sigma = Vector12d::Zero();
    sigma.head<6>() << Eigen::Vector3d::Constant(kPositionShare * unit),
        Eigen::Vector3d::Constant(kAngleSigma_rad);
    filter_.Inflate(sigma.cwiseAbs2().asDiagonal());
    matcher_.Renew(*learner_->lens(), filter_, matches_, random_);
    Correct(*learner_->lens());
    ++revision_;
  }
  learner_->Start(frames_, frame.capture_time_ns, map_, filter_);
}

}  // namespace saccade
