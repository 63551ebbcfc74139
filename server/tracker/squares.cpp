// The part of the tracker that uses square markers (slam-spec 7).
#include <algorithm>
#include <cmath>

#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr int kFewNatural = 5;  // matches, below which squares are sought around the prediction
constexpr std::size_t kConfirms = 6;  // corners found again in the next picture make a start
constexpr int kTriedAtStart = 100, kTriedAFrame = 1;
constexpr int kMetreEvery = 5;           // frames
constexpr std::int64_t kMetreWait = 90;  // frames that a map waits for its unit
constexpr std::int64_t kYoung = 300;  // frames: a map without the squares' world is given up for it
// Of a camera that a detector has found a picture ago, beyond what its corners say.
constexpr double kPositionSigma_m = 0.03, kAngleSigma_rad = 0.03;
constexpr double kVelocitySigma_m_s = 0.5, kSquaresSpinSigma_rad_s = 1.0;

Matrix12d FoundCovariance(const Matrix6d& pose) {
  Matrix12d covariance = Matrix12d::Zero();
  covariance.topLeftCorner<6, 6>() = pose;
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(kPositionSigma_m), Eigen::Vector3d::Constant(kAngleSigma_rad),
      Eigen::Vector3d::Constant(kVelocitySigma_m_s),
      Eigen::Vector3d::Constant(kSquaresSpinSigma_rad_s);
  covariance.diagonal() += sigma.cwiseAbs2();
  return covariance;
}

}  // namespace

bool Tracker::WaitsForSquares() const {
  return squares_ && squares_->has_known() && waited_for_squares_ < options_.target_frames;
}

bool Tracker::WaitsForMetre() const {
  return squares_ && !metric_ && squares_->sees_unplaced() && frames_ < kMetreWait;
}

std::optional<Start> Tracker::StartBySquares(const Frame& frame) {
  ++waited_for_squares_;
  const auto found = squares_->FindCamera(*frame.camera, /*with_known=*/true, filter_);
  if (!found) return std::nullopt;
  CameraMotion motion;
  motion.world_from_camera = found->fit.world_from_camera;
  filter_.Reset(motion, FoundCovariance(found->fit.covariance));
  const Matrix6d covariance = filter_.PoseCovariance();
  squares_->Search(frame, motion.world_from_camera, covariance, motion, true, filter_);
  if (squares_->found().size() < kConfirms) return std::nullopt;
  const auto pose =
      squares_->PoseByFound(*frame.camera, motion.world_from_camera, covariance, filter_);
  if (!pose || !filter_.Update(*frame.camera, squares_->found(), *pose).ok()) return std::nullopt;
  in_squares_world_ = true;
  std::vector<double> ranges;
  for (const Observation& each : squares_->found()) {
    ranges.push_back((*each.known_point - pose->translation).norm());
  }
  std::ranges::nth_element(ranges, ranges.begin() + std::ssize(ranges) / 2);
  const double inverse = 1.0 / std::max(1e-3, ranges[ranges.size() / 2]);
  return Start{true, {inverse, 0.5 * inverse}};
}

void Tracker::SearchSquares() {
  const bool natural = matches_.accepted >= kFewNatural;
  squares_->Search(last_frame_,
                   natural ? matches_.pose.world_from_camera : filter_.camera().world_from_camera,
                   natural ? matches_.pose.covariance : filter_.PoseCovariance(),
                   natural ? matches_.motion : filter_.WholeMotion(), in_squares_world_, filter_);
}

Rigid3 Tracker::AddSquares(std::vector<Observation>& observations) {
  const std::vector<Observation>& found = squares_->found();
  const bool natural = observations.size() >= kFewNatural;
  observations.insert(observations.end(), found.begin(), found.end());
  if (natural) return matches_.pose.world_from_camera;
  const Rigid3& predicted = filter_.camera().world_from_camera;
  return squares_->PoseByFound(*last_frame_.camera, predicted, filter_.PoseCovariance(), filter_)
      .value_or(predicted);
}

void Tracker::StartSquares(const FoundStart& start) {
  std::vector<std::pair<Timestamp, Rigid3>> poses;
  for (const FoundStart::Keyframe& keyframe : start.keyframes) {
    poses.emplace_back(keyframe.time_ns, keyframe.world_from_camera);
  }
  squares_->RecordStart(poses);
  const CameraModel& camera = *last_frame_.camera;
  if (const auto metre = squares_->FindMetre(camera)) TakeMetre(*metre);
  if (metric_) squares_->Place(camera, kTriedAtStart, filter_);
}

void Tracker::TakeMetre(double metre) {
  MapCorrection correction;
  correction.of[0] = {1.0 / metre, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  MoveMap(correction);
  squares_->ScaleViews(1.0 / metre);
  metric_ = true;
}

void Tracker::ManageSquares(const Frame& frame) {
  if (!held_) return;
  squares_->Record(frame.capture_time_ns, filter_.camera().world_from_camera);
  if (!metric_ && frames_ % kMetreEvery == 0) {
    if (const auto metre = squares_->FindMetre(*frame.camera)) TakeMetre(*metre);
  }
  if (metric_) squares_->Place(*frame.camera, kTriedAFrame, filter_);
  if (in_squares_world_ || !squares_->has_known() || frames_ > kYoung) return;
  // The map began without the squares; their world is worth more than it.
  const auto found = squares_->FindCamera(*frame.camera, /*with_known=*/true, filter_);
  if (found && found->squares > 1) StartAnew(frame);
}

bool Tracker::RecoverBySquares(const Frame& frame) {
  const auto found = squares_->FindCamera(*frame.camera, in_squares_world_, filter_);
  if (!found) return false;
  before_relocalisation_ = map_.Save(filter_);
  CameraMotion motion;
  motion.world_from_camera = found->fit.world_from_camera;
  filter_.ResetCamera(motion, FoundCovariance(found->fit.covariance));
  ++revision_;
  frames_lost_ = 0;
  monitor_.BeginRelocalisation();
  return true;
}

}  // namespace saccade
