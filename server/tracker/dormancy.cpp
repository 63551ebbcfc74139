// The part of the tracker that wakes landmarks, and keeps frames for adjustment.
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr int kMostAtOnce = 30;

}  // namespace

Matrix6d Tracker::WakeCovariance(double distance_m) const {
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Eigen::Vector3d::Constant(options_.wake_position_share * distance_m),
      Eigen::Vector3d::Constant(options_.wake_angle_sigma_rad);
  return sigma.cwiseAbs2().asDiagonal();
}

void Tracker::Wake(const CameraModel& camera) {
  const int missing = std::min(kMostAtOnce, births_.Missing(matches_));
  if (!options_.wake || missing <= 0 || map_.at_rest().size() == 0) return;
  map_.LocateAtRest();
  std::vector<Eigen::Vector2d> occupied;
  for (const LandmarkMatch& match : matches_.in_view) occupied.push_back(match.pixel);
  const auto groups =
      map_.at_rest().InView(camera, filter_.camera().world_from_camera, frames_, missing, occupied);
  const double distance_m = 1.0 / std::max(1e-6, depth_.inverse_range);
  for (const auto& [keyframe, ids] : groups) {
    map_.Wake(keyframe, ids, WakeCovariance(distance_m), frames_, filter_);
  }
}

bool Tracker::KeepForAdjustment(const Frame& frame) {
  const CameraModel& camera = *frame.camera;
  const double distance_m = 1.0 / std::max(1e-6, depth_.inverse_range);
  if (!options_.adjust || !map_.HasNews(filter_, distance_m)) return false;
  const double focal = 0.5 * (camera.intrinsics().fx + camera.intrinsics().fy);
  std::vector<GraphSighting> sightings;
  for (const LandmarkMatch& match : matches_.in_view) {
    if (!match.accepted()) continue;
    const auto ray = camera.Unproject(match.pixel - match.row_shift);
    if (!ray) continue;
    GraphSighting sighting{match.id, ray->normalized(), std::sqrt(match.noise(0, 0)) / focal, {}};
    if (const auto* known = std::get_if<Eigen::Vector3d>(&match.point)) {
      sighting.known_point = *known;
    }
    sightings.push_back(sighting);
  }
  map_.AddKeyframe(filter_, distance_m, options_.pixel_sigma_px / focal, sightings);
  keyframe_frames_[map_.keyframes().all().rbegin()->first] = frame.id;
  return true;
}

void Tracker::PublishAtRest(MapSnapshot& snapshot) const {
  const Rigid3 camera_from_world = snapshot.world_from_camera.Inverse();
  const Eigen::Matrix3d turn = camera_from_world.RotationMatrix();
  for (const auto& [id, dormant] : map_.at_rest().all()) {
    if (!dormant.place.somewhere) continue;
    FeatureSnapshot& feature = snapshot.features.emplace_back();
    feature.id = id;
    feature.matched_count = dormant.landmark.matched;
    feature.point_in_world = dormant.place.point_in_world;
    // As well as it was known. While errors are counted from the same place as then that is all;
    // later its keyframe is as well known as it will be when it is woken.
    feature.covariance_in_world = dormant.covariance_in_world;
    if (dormant.home != home_) {
      const double off = options_.wake_position_share * dormant.place.range_m;
      feature.covariance_in_world += off * off * Eigen::Matrix3d::Identity();
    }
    feature.covariance_in_camera = turn * feature.covariance_in_world * turn.transpose();
    feature.depth_known = true;
  }
}

}  // namespace saccade
