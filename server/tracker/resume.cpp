// The part of the tracker that leaves a place for another run, and comes back to it.
#include <absl/strings/str_format.h>

#include <cmath>

#include "server/map/stored_map.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr std::size_t kFewestPlaces = 2;      // views to recognise a map by
constexpr std::size_t kFewestLandmarks = 20;  // to follow it by
constexpr double kSameLens = 0.02;            // of the focal length: more, and depths are off, too

}  // namespace

std::shared_ptr<const StoredMap> Tracker::Store() const {
  if (!started_ || !held_ || resuming_ || relocaliser_.size() < kFewestPlaces) return nullptr;
  // A pose that the next frames may refuse has changed the map already.
  const FilterState& filter = before_relocalisation_ ? before_relocalisation_->filter : filter_;
  auto stored = std::make_shared<StoredMap>();
  stored->lens = (learner_ ? learner_->lens() : source_.camera)->intrinsics();
  stored->metric = metric_;
  stored->inverse_range = depth_.inverse_range;
  map_.StoreInto(*stored, filter);
  if (stored->at_rest.size() + stored->known.size() < kFewestLandmarks) return nullptr;
  stored->places = relocaliser_.views();
  return stored;
}

absl::Status Tracker::Resume(std::shared_ptr<const StoredMap> map) {
  const CameraIntrinsics lens = (learner_ ? learner_->lens() : source_.camera)->intrinsics();
  if (lens.width != map->lens.width || lens.height != map->lens.height ||
      std::abs(std::log(lens.fx / map->lens.fx)) > kSameLens ||
      std::abs(std::log(lens.fy / map->lens.fy)) > kSameLens) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the map was made by a camera of %d x %d, fx %.1f; this one has %d x %d, fx %.1f",
        map->lens.width, map->lens.height, map->lens.fx, lens.width, lens.height, lens.fx));
  }
  Reset();
  if (!map_.Load(*map)) {
    Reset();
    return absl::DataLossError("the map is damaged");
  }
  relocaliser_.Load(map->places);
  metric_ = map->metric;
  depth_ = {map->inverse_range, 0.5 * map->inverse_range};
  started_ = held_ = resuming_ = true;
  monitor_.Lose();
  return absl::OkStatus();
}

}  // namespace saccade
