// The part of the tracker that finds its way back: keyframes, relocalisation, seeded features.
#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>

#include "server/filter/new_clone.hpp"
#include "server/tracker/depth_knowledge.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr int kQueryEvery = 2;               // lost frames: a query costs tens of ms
constexpr double kKeyframeAngle_rad = 0.26;  // 15 deg
constexpr double kKeyframeShare = 0.2;       // of the distance to what is in view
constexpr std::uint32_t kMatured = 8;        // matches before a feature is worth recognising
// What is known of a camera found again, before the features seen from it are used (slam-spec 6).
constexpr double kPositionShare = 0.3;  // of the distance to what is in view
constexpr double kAngleSigma_rad = 0.26;
constexpr double kVelocityShare_1_s = 0.5;
constexpr double kRecoveredSpinSigma_rad_s = 1.0;
constexpr double kFoundSigma_px = 1.5;

}  // namespace

void Tracker::KeepKeyframe(const Frame& frame) {
  if (monitor_.status() != TrackingStatus::kTracking || loops_.ReadsRelocaliser()) return;
  const Rigid3& pose = filter_.camera().world_from_camera;
  const double distance = kKeyframeShare / std::max(1e-6, depth_.inverse_range);
  if (!relocaliser_.NeedsView(pose, distance, kKeyframeAngle_rad)) {
    relocaliser_.Densify(*frame.camera, [this](FeatureId id) { return map_.Where(id, filter_); });
    return;
  }
  std::vector<ViewPoint> points;
  for (const LandmarkMatch& match : matches_.in_view) {
    if (!match.accepted()) continue;
    const Landmark* landmark = map_.in_use().Find(match.id);
    if (landmark == nullptr || landmark->matched < kMatured) continue;
    if (landmark->known) {
      points.push_back({match.id, match.pixel, landmark->known->point_in_world});
    } else if (filter_.Has(match.id)) {
      const FeatureMarginal marginal = filter_.Marginal(match.id);
      if (!KnownTo(marginal, DepthKnowledge::kToRecognise)) continue;
      points.push_back({match.id, match.pixel, marginal.point_in_world});
    }
  }
  // Too few points is no error: a later frame from here may have more.
  relocaliser_.AddView(frame.id, frame.grey, pose, points).IgnoreError();
}

void Tracker::Recover(const Frame& frame) {
  matches_ = FrameMatches();
  if (squares_ && RecoverBySquares(frame)) return;
  if (frames_lost_++ % kQueryEvery != 0) return;
  const auto found = relocaliser_.Query(frame.grey, *frame.camera,
                                        [this](FeatureId id) { return map_.Where(id, filter_); });
  if (!found) return;
  before_relocalisation_ = map_.Save(filter_);
  if (!Accept(*found, *frame.camera)) {
    Revert();
    return;
  }
  ++revision_;
  frames_lost_ = 0;
  monitor_.BeginRelocalisation();
}

void Tracker::ResumeAfterGap() {
  has_frame_ = false;  // encoders and rates of the frame before say nothing of this one
  suspension_.Forget();
  if (!started_) return;
  Revert();
  if (resuming_) resuming_since_ns_.reset();
  if (monitor_.status() == TrackingStatus::kInitialising || relocaliser_.size() == 0) {
    Reset();
    return;
  }
  monitor_.Lose();
  frames_lost_ = 0;  // the next frame is asked at once
}

bool Tracker::Accept(const Relocalisation& found, const CameraModel& camera) {
  const double unit = 1.0 / std::max(1e-6, depth_.inverse_range);
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(kPositionShare * unit),
      Eigen::Vector3d::Constant(kAngleSigma_rad),
      Eigen::Vector3d::Constant(kVelocityShare_1_s * unit),
      Eigen::Vector3d::Constant(kRecoveredSpinSigma_rad_s);
  CameraMotion motion;
  motion.world_from_camera = found.world_from_camera;
  filter_.ResetCamera(motion, sigma.cwiseAbs2().asDiagonal());
  for (const Correspondence& inlier : found.inliers) {
    const auto known = map_.Recall(inlier.id);
    if (!known || map_.StateOf(inlier.id, filter_) != LandmarkState::kAtRest) continue;
    map_.Wake(known->anchor, std::array{inlier.id}, WakeCovariance(unit), frames_, filter_);
  }
  std::vector<Observation> observations;
  for (const Correspondence& inlier : found.inliers) {
    const Landmark* landmark = map_.in_use().Find(inlier.id);
    if (landmark == nullptr) continue;
    Observation observation;
    observation.id = inlier.id;
    if (landmark->known) observation.known_point = landmark->known->point_in_world;
    observation.pixel = inlier.pixel;
    observation.noise = kFoundSigma_px * kFoundSigma_px * Eigen::Matrix2d::Identity();
    observations.push_back(observation);
  }
  return filter_.Update(camera, observations, found.world_from_camera).ok();
}

void Tracker::Revert() {
  if (!before_relocalisation_) return;
  map_.Restore(*before_relocalisation_, filter_);
  before_relocalisation_.reset();
}

absl::StatusOr<FeatureId> Tracker::SeedFeature(const Frame& clicked_frame,
                                               const Rigid3& world_from_camera,
                                               const Eigen::Vector2d& pixel, double depth_prior_m,
                                               double depth_sigma_m) {
  if (!started_ || monitor_.status() != TrackingStatus::kTracking) {
    return absl::FailedPreconditionError("feature: the tracker is not tracking now");
  }
  if (!(depth_prior_m > 0.0) || !(depth_sigma_m > 0.0) || !std::isfinite(depth_prior_m) ||
      !std::isfinite(depth_sigma_m)) {
    return absl::InvalidArgumentError("feature: depth and its sigma must be above 0");
  }
  if (!pixel.allFinite() || !clicked_frame.camera || !clicked_frame.camera->InImage(pixel)) {
    return absl::InvalidArgumentError("feature: the pixel is not in the picture");
  }
  const auto patch = front_end_->CutClicked(clicked_frame, pixel);
  if (!patch.ok()) return patch.status();
  const CameraModel& camera = *last_frame_.camera;
  const Rigid3& pose = filter_.camera().world_from_camera;
  const double range = depth_prior_m / std::max(0.1, patch->birth_bearing.z());
  PointFromClone clicked{world_from_camera, patch->birth_bearing,
                         TangentBasis(patch->birth_bearing), 1.0 / range};
  const auto expected = PredictFromClone(camera, pose, clicked);
  if (!expected || !camera.InImage(expected->pixel, 12.0)) {
    return absl::NotFoundError("feature: what was clicked is not in view any more");
  }
  const double inverse_sigma = depth_sigma_m / depth_prior_m / range;
  const Eigen::Vector2d along = expected->d_point.col(2) * inverse_sigma;
  const Eigen::Matrix2d spread = along * along.transpose() + 4.0 * Eigen::Matrix2d::Identity();
  const auto seen =
      front_end_->FindClicked(*patch, {nullptr, clicked, pose, expected->pixel, spread});
  if (!seen.ok()) return seen.status();
  const double now = (pose.Inverse() * (world_from_camera * (clicked.bearing * range))).norm();
  const Births::DepthGuess depth{1.0 / now, depth_sigma_m / depth_prior_m / now};
  std::optional<FeatureId> id;
  {
    const NewClone clone(filter_);
    id = births_.Plant(last_frame_, *seen, depth, clone.id(), matches_.motion, matcher_,
                       *front_end_, filter_, map_.in_use());
  }
  KeepForAdjustment(last_frame_);
  if (!id) return absl::NotFoundError("feature: no texture to track at this pixel");
  map_.in_use().Find(*id)->seeded = true;
  return *id;
}

}  // namespace saccade
