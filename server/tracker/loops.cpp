// The part of the tracker that closes loops.
#include <algorithm>
#include <limits>

#include "server/tracker/tracker_impl.hpp"

namespace saccade {
namespace {

constexpr std::int64_t kOld = 150;  // frames that an old landmark was not met
constexpr double kTorn = 0.02;      // of the distance: between where two keyframes want a landmark

}  // namespace

/// Landmarks at rest that were not met for 5 s, or were looked for in vain where they should be.
OldLandmarks Tracker::Impl::OldOnes() const {
  OldLandmarks old;
  for (const auto& [id, dormant] : dormant_.all()) {
    if (dormant.failures == 0 && dormant.landmark.last_matched_frame > frames_ - kOld) continue;
    const auto known = refiner_.Remember(id);
    if (known && known->estimate.inverse_range > 0.0) old.emplace_back(&dormant, *known);
  }
  return old;
}

void Tracker::Impl::CloseLoops(const Frame& frame) {
  if (!options_.loops || !options_.wake || !options_.adjust) return;
  const auto is_known = [](const LandmarkMatch& match) {
    return std::holds_alternative<Eigen::Vector3d>(match.point);
  };
  // A target in view defines the world better than any loop.
  if (std::any_of(matches_.in_view.begin(), matches_.in_view.end(), is_known)) return;
  const OldLandmarks old = loops_.WantsOld(frames_) ? OldOnes() : OldLandmarks();
  KeyframeId rigid_from = std::numeric_limits<KeyframeId>::max();
  for (const Landmark& landmark : map_.all()) {
    const bool counts = !landmark.woken && !old.empty() && filter_.Has(landmark.id);
    const auto known = counts ? refiner_.Remember(landmark.id) : std::nullopt;
    if (known) rigid_from = std::min(rigid_from, known->anchor);
  }
  const auto correction =
      loops_.Step({frames_, frame, pyramid_, filter_, matches_, refiner_.graph(), old, rigid_from});
  times_.waited_ms += loops_.waited_ms();
  if (correction) MoveMap(*correction);
}

/// Landmarks of the old part that were woken where the new part expected them: they belong to
/// where they were, not to where the filter goes, and know nothing new.
void Tracker::Impl::RestTorn(const MapCorrection& correction) {
  std::vector<FeatureId> torn;
  for (const Landmark& landmark : map_.all()) {
    const auto known = refiner_.Remember(landmark.id);
    if (!landmark.woken || !known || !(known->estimate.inverse_range > 0.0)) continue;
    const Eigen::Vector3d point = known->PointInWorld();
    const double apart =
        (correction.Of(known->anchor) * point - correction.newest() * point).norm();
    if (apart * depth_.inverse_range < kTorn) continue;
    torn.push_back(landmark.id);
    DormantLandmark dormant;
    dormant.landmark = landmark;
    dormant.landmark.woken.reset();
    const FeatureMarginal marginal = filter_.Marginal(landmark.id);
    dormant.inverse_range_sigma = marginal.inverse_range_sigma;
    dormant.covariance_in_world = marginal.covariance_in_world;
    dormant_.Put(std::move(dormant));
  }
  filter_.Remove(torn);
  map_.Remove(torn);
}

/// The old part stays, and so does where the world began: whatever hangs on the first keyframes or
/// a target does not move. The filter is the same in other coordinates.
void Tracker::Impl::MoveMap(const MapCorrection& correction) {
  RestTorn(correction);
  relocaliser_.Move([&](FeatureId id) -> std::optional<Similarity3> {
    if (filter_.Has(id)) return correction.newest();
    const auto known = refiner_.Remember(id);
    if (!known) return std::nullopt;
    return correction.Of(known->anchor);
  });
  dormant_.Move([&](FeatureId id) -> Similarity3 {
    const auto known = refiner_.Remember(id);
    return known ? correction.Of(known->anchor) : Similarity3();
  });
  refiner_.Move(correction, filter_);
  depth_.inverse_range /= correction.newest().scale;
  depth_.inverse_range_sigma /= correction.newest().scale;
  before_relocalisation_.reset();
  ++revision_;
}

}  // namespace saccade
