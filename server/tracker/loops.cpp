// The part of the tracker that closes loops.
#include <algorithm>
#include <limits>

#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr std::int64_t kOld = 150;  // frames that an old landmark was not met
constexpr double kTorn = 0.02;      // of the distance: between where two keyframes want a landmark

}  // namespace

/// Landmarks at rest that were not met for 5 s, or were looked for in vain where they should be.
OldLandmarks Tracker::OldOnes() const {
  OldLandmarks old;
  for (const auto& [id, dormant] : map_.at_rest().all()) {
    if (dormant.failures == 0 && dormant.landmark.last_matched_frame > frames_ - kOld) continue;
    const auto known = map_.Recall(id);
    if (known && known->estimate.inverse_range > 0.0) old.emplace_back(&dormant, *known);
  }
  return old;
}

void Tracker::CloseLoops(const Frame& frame) {
  const ImagePyramid* pyramid = front_end_->pyramid();
  if (!options_.loops || !options_.wake || !options_.adjust || pyramid == nullptr) return;
  const auto is_known = [](const LandmarkMatch& match) {
    return std::holds_alternative<Eigen::Vector3d>(match.point);
  };
  // A target in view defines the world better than any loop.
  if (std::any_of(matches_.in_view.begin(), matches_.in_view.end(), is_known)) return;
  const OldLandmarks old = loops_.WantsOld(frames_) ? OldOnes() : OldLandmarks();
  KeyframeId rigid_from = std::numeric_limits<KeyframeId>::max();
  for (const Landmark& landmark : map_.in_use().all()) {
    const bool counts = !landmark.woken && !old.empty() && filter_.Has(landmark.id);
    const auto known = counts ? map_.Recall(landmark.id) : std::nullopt;
    if (known) rigid_from = std::min(rigid_from, known->anchor);
  }
  const auto correction =
      loops_.Step({frames_, frame, *pyramid, filter_, matches_, map_.keyframes(), old, rigid_from});
  times_.waited_ms += loops_.waited_ms();
  if (correction) MoveMap(*correction);
}

/// The old part stays, and so does where the world began: whatever hangs on the first keyframes or
/// a target does not move. The filter is the same in other coordinates.
void Tracker::MoveMap(const MapCorrection& correction) {
  refiner_.Drop(filter_);
  map_.Move(correction, kTorn / depth_.inverse_range, filter_);
  relocaliser_.Move([&](FeatureId id) -> std::optional<Similarity3> {
    if (filter_.Has(id)) return correction.newest();
    const auto known = map_.Recall(id);
    if (!known) return std::nullopt;
    return correction.Of(known->anchor);
  });
  depth_.inverse_range /= correction.newest().scale;
  depth_.inverse_range_sigma /= correction.newest().scale;
  before_relocalisation_.reset();
  ++revision_;
}

}  // namespace saccade
