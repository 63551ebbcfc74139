// The part of FilterState that takes a whole map over (slam-spec 7, targetless start).
#include <algorithm>

#include "server/filter/filter_state.hpp"

namespace saccade {
namespace {

constexpr int kMature = 1000;  // updates: depths are known, Jacobians need no first estimates

}  // namespace

std::vector<CloneId> FilterState::Seed(const MapSeed& seed, const CameraMotion& camera,
                                       const Matrix12d& covariance) {
  Reset(camera, covariance);
  Robot& robot = Of(kFirstRobot);
  const int number = IslandOf(robot.block);
  Island& island = IslandAt(number);
  island.updates = kMature;
  const int first = robot.model->dim();
  std::vector<int> rows;  // of seed.covariance, in the order of the state
  if (robot.readout != kNoBlock) {
    robot.readout_s = seed.readout_s;
    rows.push_back(0);
  }
  std::vector<CloneId> ids;
  for (std::size_t k = 0; k < seed.clones.size(); ++k) {
    const BlockId block = Append(BlockKind::kClone, kPoseDim, number);
    for (int r = 0; r < kPoseDim; ++r) rows.push_back(1 + kPoseDim * static_cast<int>(k) + r);
    clones_.push_back({next_clone_, block, 0, kMature, seed.clones[k], seed.clones[k]});
    ids.push_back(next_clone_++);
  }
  const int points = 1 + kPoseDim * static_cast<int>(seed.clones.size());
  for (std::size_t k = 0; k < seed.features.size(); ++k) {
    const MapSeed::Feature& from = seed.features[k];
    Feature feature;
    feature.id = from.id;
    feature.clone = ids[static_cast<std::size_t>(from.clone)];
    feature.point = feature.first = {from.bearing, TangentBasis(from.bearing), from.inverse_range};
    feature.birth_covariance = from.birth_covariance;
    feature.block = Append(BlockKind::kFeature, form_->dim(), number);
    for (int r = 3 - form_->dim(); r < 3; ++r) {
      rows.push_back(points + 3 * static_cast<int>(k) + r);
    }
    features_.push_back(feature);
    ++clones_[static_cast<std::size_t>(from.clone)].users;
  }
  for (std::size_t c = 0; c < rows.size(); ++c) {
    for (std::size_t r = c; r < rows.size(); ++r) {
      island.p.lower(first + static_cast<int>(r), first + static_cast<int>(c)) =
          seed.covariance(rows[r], rows[c]);
    }
  }
  return ids;
}

}  // namespace saccade
