// The part of FilterState by which blocks enter, leave and come together.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/filter/filter_state.hpp"

namespace saccade {

BlockId FilterState::Append(BlockKind kind, int size, int island) {
  IslandAt(island).p.Append(size);
  return layout_.Add(kind, size, island);
}

CloneId FilterState::AddClone(RobotId id) {
  const Robot& robot = Of(id);
  const int number = IslandOf(robot.block), at = At(robot.block);
  Island& island = IslandAt(number);
  const Eigen::MatrixXd rows = island.p.Block(at, 0, kPoseDim, island.p.dim());
  const BlockId block = Append(BlockKind::kClone, kPoseDim, number);
  const int offset = At(block);
  if (island.checkpoint) island.checkpoint->journal.Add(Journal::Cloned{at});
  for (int c = 0; c < offset; ++c) {
    for (int r = 0; r < kPoseDim; ++r) island.p.lower(offset + r, c) = rows(r, c);
  }
  island.p.AddBlock(offset, rows.middleCols(at, kPoseDim));
  clones_.push_back(
      {next_clone_, block, 0, island.updates, robot.motion.world_from_camera, robot.first_pose});
  return next_clone_++;
}

CloneId FilterState::AddClone(const Rigid3& world_from_camera, const Matrix6d& covariance,
                              RobotId robot) {
  const int number = IslandOf(Of(robot).block);
  Island& island = IslandAt(number);
  const BlockId block = Append(BlockKind::kClone, kPoseDim, number);
  if (island.checkpoint) island.checkpoint->journal.Add(Journal::Appended{kPoseDim});
  island.p.AddBlock(At(block), covariance);
  // Not young: its features have been measured often.
  clones_.push_back({next_clone_, block, 0, 0, world_from_camera, world_from_camera});
  return next_clone_++;
}

CloneId FilterState::AddMarker(const Rigid3& world_from_marker, const Matrix6d& covariance,
                               RobotId robot) {
  const CloneId id = AddClone(world_from_marker, covariance, robot);
  clones_.back().users = 1;  // no feature's: Remove() leaves it
  return id;
}

absl::Status FilterState::AddFeature(CloneId clone, const FeatureBirth& birth) {
  const auto at = std::ranges::lower_bound(clones_, clone, {}, &Clone::id);
  if (at == clones_.end() || at->id != clone) {
    return absl::InvalidArgumentError(absl::StrCat("filter: no pose clone ", clone));
  }
  if (Has(birth.id)) {
    return absl::InvalidArgumentError(absl::StrCat("filter: feature id ", birth.id, " is taken"));
  }
  if (!(birth.inverse_range >= 0.0) || !(birth.inverse_range_sigma > 0.0) ||
      !std::isfinite(birth.inverse_range_sigma) || !birth.bearing.allFinite() ||
      std::abs(birth.bearing.norm() - 1.0) > 1e-6 || !birth.bearing_covariance.allFinite()) {
    return absl::InvalidArgumentError(
        "filter: a feature needs a unit bearing, inverse range >= 0 and its "
        "sigma above 0");
  }
  Feature feature;
  feature.id = birth.id;
  feature.clone = clone;
  feature.point = feature.first = {birth.bearing, TangentBasis(birth.bearing), birth.inverse_range};
  const Eigen::Matrix<double, 3, 2>& basis = feature.point.basis;
  feature.birth_covariance = basis.transpose() * birth.bearing_covariance * basis;
  const int number = IslandOf(at->block);
  Island& island = IslandAt(number);
  feature.block = Append(BlockKind::kFeature, form_->dim(), number);
  if (island.checkpoint) island.checkpoint->journal.Add(Journal::Appended{form_->dim()});
  island.p.AddBlock(At(feature.block),
                    form_->BirthCovariance(feature.birth_covariance, birth.inverse_range_sigma));
  features_.insert(std::ranges::upper_bound(features_, birth.id, {}, &Feature::id), feature);
  ++at->users;
  return absl::OkStatus();
}

void FilterState::TellRange(FeatureId id, double inverse_range, double sigma) {
  Feature& feature = *std::ranges::lower_bound(features_, id, {}, &Feature::id);
  feature.point.inverse_range = feature.first.inverse_range = inverse_range;
  const int at = At(feature.block) + form_->range();
  Island& island = IslandAt(IslandOf(feature.block));
  island.p.ReplaceBlock(at, Eigen::Matrix<double, 1, 1>(sigma * sigma));
  if (island.checkpoint) island.checkpoint->journal.Add(Journal::Told{at});
}

void FilterState::Remove(std::span<const FeatureId> ids) {
  std::vector<BlockId> gone;
  for (const FeatureId id : ids) {
    const Feature* found = Find(id);
    if (found == nullptr) continue;
    gone.push_back(found->block);
    for (Clone& clone : clones_) clone.users -= clone.id == found->clone ? 1 : 0;
    features_.erase(features_.begin() + (found - features_.data()));
  }
  for (const Clone& clone : clones_) {
    if (clone.users == 0) gone.push_back(clone.block);
  }
  std::erase_if(clones_, [](const Clone& clone) { return clone.users == 0; });
  RemoveBlocks(gone);
}

void FilterState::RemoveBlocks(std::span<const BlockId> gone) {
  std::vector<std::vector<BlockId>> by_island(islands_.size());
  for (const BlockId id : gone) by_island[static_cast<std::size_t>(IslandOf(id))].push_back(id);
  for (int number = 0; number < layout_.islands(); ++number) {
    const std::vector<BlockId>& here = by_island[static_cast<std::size_t>(number)];
    if (here.empty()) continue;
    Island& island = IslandAt(number);
    std::vector<int> keep = layout_.Remove(number, here);
    island.p.Keep(keep);
    if (island.checkpoint) island.checkpoint->journal.Add(Journal::Kept{std::move(keep)});
  }
}

void FilterState::Join(int into, int from) {
  if (into == from) return;
  Island& island = IslandAt(into);
  Island& other = IslandAt(from);
  // Clones keep their age.
  const int updates = std::max(island.updates, other.updates);
  for (Clone& clone : In(into, clones_)) clone.born += updates - island.updates;
  for (Clone& clone : In(from, clones_)) clone.born += updates - other.updates;
  layout_.Join(into, from);
  island.p.Append(other.p);
  island.updates = updates;
  island.checkpoint.reset();
  other = Island();
}

std::vector<FeatureId> FilterState::RemoveBehind() {
  std::vector<FeatureId> gone;
  for (const Feature& feature : features_) {
    const int at = At(feature.block) + form_->range();
    const double variance = IslandAt(IslandOf(feature.block)).p.at(at, at);
    const double sigma = std::sqrt(std::max(0.0, variance));
    if (feature.point.inverse_range + 2.0 * sigma < 0.0) gone.push_back(feature.id);
  }
  Remove(gone);
  return gone;
}

}  // namespace saccade
