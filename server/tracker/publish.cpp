// The part of the tracker that tells others what it knows.
#include "server/tracker/tracker.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr double kDepthKnown = 0.1;  // sigma / depth

/// Covariance of a fixed point in the camera frame: only the pose is uncertain.
Eigen::Matrix3d KnownInCamera(const FilterState& filter, const Eigen::Vector3d& point) {
  const Rigid3 camera_from_world = filter.camera().world_from_camera.Inverse();
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose.leftCols<3>() = -camera_from_world.RotationMatrix();
  by_pose.rightCols<3>() = Skew(camera_from_world * point);
  return by_pose * filter.PoseCovariance() * by_pose.transpose();
}

}  // namespace

Difficulties Tracker::SeeDifficulties() const {
  constexpr int kFollowed = 8;            // matches...
  constexpr double kFollowedShare = 0.3;  // ...and of the searches
  Difficulties seen;
  seen.waits_for_target = !started_ && starter_.waits_for_target();
  seen.resumes = resuming_;
  seen.turns_followed = started_ && !held_ && matches_.accepted >= kFollowed &&
                        matches_.accepted >= kFollowedShare * matches_.attempted;
  seen.speed_rad_s = filter_.WholeMotion().angular_velocity_rad_s.norm();
  seen.in_view = matches_.accepted;
  seen.too_few_hz = rate_.TooFew();
  seen.lens_growth = lens_evidence_.Growth();
  return seen;
}

void Tracker::PublishKeyframes() {
  const KeyframeGraph& graph = map_.keyframes();
  if (keyframe_places_ && keyframe_places_->generation == generation_ &&
      keyframe_places_->metric == metric_ && keyframe_changes_ == graph.changes()) {
    return;
  }
  keyframe_changes_ = graph.changes();
  std::erase_if(keyframe_frames_,
                [&](const auto& each) { return !graph.all().contains(each.first); });
  auto places = std::make_shared<KeyframePlaces>();
  places->generation = generation_;
  places->metric = metric_;
  places->keyframes.reserve(keyframe_frames_.size());
  for (const auto& [id, frame] : keyframe_frames_) {
    const KeyframeGraph::Keyframe& keyframe = graph.all().at(id);
    places->keyframes.push_back({id, frame, keyframe.world_from_camera, keyframe.distance_m});
  }
  keyframe_places_ = std::move(places);
}

std::shared_ptr<const MapSnapshot> Tracker::Publish(const Frame& frame, const StageTimes& times) {
  map_.LocateAtRest();
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = frame.id;
  snapshot->capture_time_ns = frame.capture_time_ns;
  snapshot->status = monitor_.status();
  snapshot->quality = monitor_.quality();
  const CameraMotion camera = filter_.WholeMotion();
  const Difficulties difficulties = SeeDifficulties();
  snapshot->advice = AdviceFor(monitor_, difficulties);
  if (learner_) {
    if (snapshot->advice.empty()) snapshot->advice = LearningWords(learner_->state());
  }
  if (difficulties.lens_growth && !lens_told_) Log(snapshot->advice);
  lens_told_ = lens_told_ || difficulties.lens_growth;
  snapshot->metric = metric_;
  snapshot->world_from_camera = camera.world_from_camera;
  snapshot->pose_covariance = filter_.PoseCovariance();
  snapshot->velocity_in_world = camera.velocity_m_s;
  snapshot->angular_velocity_in_camera = camera.angular_velocity_rad_s;
  snapshot->attempted = matches_.attempted + SquaresAttempted();
  snapshot->matched = matches_.accepted + SquaresFound();
  snapshot->searched_px2 = matches_.searched_px2;
  snapshot->map_revision = revision_;
  snapshot->map_generation = generation_;
  snapshot->stage_ms = times;
  snapshot->features.reserve(map_.in_use().all().size() + map_.at_rest().size());
  auto match = matches_.in_view.begin();  // both lists have rising ids
  const Eigen::Matrix3d turn = camera.world_from_camera.RotationMatrix();
  for (const Landmark& landmark : map_.in_use().all()) {
    FeatureSnapshot& feature = snapshot->features.emplace_back();
    feature.id = landmark.id;
    feature.matched_count = landmark.matched;
    if (landmark.known) {
      feature.point_in_world = landmark.known->point_in_world;
      feature.covariance_in_camera = KnownInCamera(filter_, feature.point_in_world);
      feature.depth_known = true;
    } else {
      const FeatureMarginal marginal = filter_.Marginal(landmark.id);
      feature.point_in_world = marginal.point_in_world;
      feature.covariance_in_world = marginal.covariance_in_world;
      feature.covariance_in_camera = marginal.covariance_in_camera;
      const double depth =
          turn.col(2).dot(marginal.point_in_world - camera.world_from_camera.translation);
      feature.depth_known = depth > 0 && feature.covariance_in_camera(2, 2) <
                                             kDepthKnown * kDepthKnown * depth * depth;
    }
    while (match != matches_.in_view.end() && match->id < landmark.id) ++match;
    if (match == matches_.in_view.end() || match->id != landmark.id) continue;
    feature.pixel = match->pixel;
    if (match->searched) {
      feature.state = match->accepted() ? FeatureState::kMeasured : FeatureState::kFailed;
    }
  }
  PublishAtRest(*snapshot);
  PublishKeyframes();
  return snapshot;
}

}  // namespace saccade
