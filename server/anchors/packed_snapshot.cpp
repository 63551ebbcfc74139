#include "server/anchors/packed_snapshot.hpp"

#include <utility>

namespace saccade {
namespace {

/// As the tracker publishes it (server/tracker/dormancy.cpp).
FeatureSnapshot Whole(const RestingFeature& resting, const Eigen::Matrix3d& camera_from_world) {
  FeatureSnapshot feature;
  feature.id = resting.id;
  feature.matched_count = resting.matched_count;
  feature.depth_known = resting.depth_known;
  feature.point_in_world = resting.point_in_world;
  feature.covariance_in_world = resting.covariance_in_world;
  feature.covariance_in_camera =
      camera_from_world * resting.covariance_in_world * camera_from_world.transpose();
  return feature;
}

Eigen::Matrix3d CameraFromWorld(const MapSnapshot& snapshot) {
  return snapshot.world_from_camera.Inverse().RotationMatrix();
}

/// Whether `feature` says nothing that its resting form does not, but for rounding.
bool Rests(const FeatureSnapshot& feature, const Eigen::Matrix3d& expected_in_camera) {
  constexpr double kRounding = 1e-9;
  const Eigen::Matrix3d& given = feature.covariance_in_camera;
  return feature.state == FeatureState::kNotAttempted && !feature.pixel &&
         (given - expected_in_camera).norm() <= kRounding * given.norm();
}

}  // namespace

PackedSnapshot::PackedSnapshot(const MapSnapshot& snapshot, const PackedSnapshot* before) {
  const Eigen::Matrix3d turn = CameraFromWorld(snapshot);
  std::vector<RestingFeature> resting;
  std::size_t awake = snapshot.features.size();
  for (; awake > 0; --awake) {
    const FeatureSnapshot& feature = snapshot.features[awake - 1];
    const RestingFeature rests{feature.id, feature.matched_count, feature.depth_known,
                               feature.point_in_world, feature.covariance_in_world};
    if (!Rests(feature, Whole(rests, turn).covariance_in_camera)) break;
    resting.push_back(rests);
  }
  awake_ = snapshot;
  awake_.features = {snapshot.features.begin(),
                     snapshot.features.begin() + static_cast<std::ptrdiff_t>(awake)};
  shared_ = before != nullptr && *before->resting_ == resting;
  resting_ =
      shared_ ? before->resting_ : std::make_shared<const std::vector<RestingFeature>>(resting);
}

std::shared_ptr<const MapSnapshot> PackedSnapshot::Unpack() const {
  auto snapshot = std::make_shared<MapSnapshot>(awake_);
  const Eigen::Matrix3d turn = CameraFromWorld(*snapshot);
  snapshot->features.reserve(awake_.features.size() + resting_->size());
  for (auto rests = resting_->rbegin(); rests != resting_->rend(); ++rests) {
    snapshot->features.push_back(Whole(*rests, turn));
  }
  return snapshot;
}

std::size_t PackedSnapshot::bytes() const {
  return sizeof(PackedSnapshot) + awake_.features.capacity() * sizeof(FeatureSnapshot) +
         (shared_ ? 0 : resting_->capacity() * sizeof(RestingFeature));
}

}  // namespace saccade
