#include "server/surface/surface_map.hpp"

#include <algorithm>
#include <limits>

#include "server/pipeline/frame_cost.hpp"
#include "server/surface/view_choice.hpp"

namespace saccade {
namespace {

constexpr double kSeenAgain = 0.4;  // of a chunk's triangles: then what was before is gone

}  // namespace

absl::StatusOr<std::unique_ptr<SurfaceMap>> SurfaceMap::Create(const SurfaceOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  return std::unique_ptr<SurfaceMap>(new SurfaceMap(options));
}

bool SurfaceMap::Wants(FrameId frame, const KeyframePlaces& places) const {
  if (places.keyframes.empty() || places.keyframes.back().frame != frame) return false;
  if (places.generation != generation_) return true;
  const KeyframePlace& place = places.keyframes.back();
  if (kept_.contains(place.id)) return false;
  return std::none_of(kept_.begin(), kept_.end(), [&](const auto& each) {
    return ApartBy(place, each.second.place, options_) < 1.0;
  });
}

void SurfaceMap::Add(const Frame& frame, const KeyframePlaces& places) {
  SetPlaces(places);
  const auto place =
      std::find_if(places.keyframes.rbegin(), places.keyframes.rend(),
                   [&](const KeyframePlace& each) { return each.frame == frame.id; });
  if (place == places.keyframes.rend() || !frame.camera || kept_.contains(place->id)) return;
  const double begin_ms = ThreadCpuMs();
  if (static_cast<int>(kept_.size()) >= options_.max_keyframes) DropOldest();
  Kept& kept = kept_[place->id];
  kept.place = *place;
  kept.picture = rectifier_.Rectify(frame);
  for (auto& [id, other] : kept_) other.tried = false;
  ++cost_.keyframes;
  cost_.picture_ms += ThreadCpuMs() - begin_ms;
}

void SurfaceMap::ForgetFusion() {
  version_ = version();
  if (fusion_) ++edition_;
  fusion_.reset();
  for (auto& [id, kept] : kept_) {
    kept.confirm_due = kept.confirm_due || kept.fused.has_value();
    kept.fused.reset();
  }
}

void SurfaceMap::ForgetAll() {
  kept_.clear();
  places_.clear();
  ForgetRestored();
  ForgetFusion();
}

void SurfaceMap::ForgetRestored() {
  if (!restored_.empty()) ++edition_;
  restored_.clear();
  restored_voxel_ = 0.0f;
}

void SurfaceMap::Restore(const SurfaceSnapshot& before) {
  ForgetAll();
  generation_ = before.generation;
  restored_voxel_ = before.voxel;
  restored_unit_ = false;
  ++edition_;
  for (const auto& [index, chunk] : before.chunks) {
    SurfaceChunk copy = *chunk;
    copy.version = ++version_;
    restored_[index] = std::make_shared<const SurfaceChunk>(std::move(copy));
  }
}

SurfaceSnapshot SurfaceMap::Snapshot() {
  SurfaceSnapshot snapshot{generation_, edition_, version(), voxel(), chunks()};
  for (auto before = restored_.begin(); before != restored_.end();) {
    const auto& [index, chunk] = *before;
    auto& now = snapshot.chunks[index];
    const bool seen_again = now && static_cast<double>(now->triangles.size()) >
                                       kSeenAgain * static_cast<double>(chunk->triangles.size());
    if (!seen_again) now = chunk;
    before = seen_again ? restored_.erase(before) : std::next(before);
  }
  return snapshot;
}

void SurfaceMap::SetPlaces(const KeyframePlaces& places) {
  if (places.generation != generation_) ForgetAll();
  if (places.metric != metric_) {  // another unit
    if (restored_unit_) ForgetRestored();
    ForgetFusion();
  }
  restored_unit_ = true;
  generation_ = places.generation;
  metric_ = places.metric;
  std::map<std::int64_t, KeyframePlace> now;
  for (const KeyframePlace& place : places.keyframes) now.emplace(place.id, place);
  for (auto& [id, kept] : kept_) {
    if (const auto there = now.find(id); there != now.end()) {
      kept.place = there->second;
    } else {
      Follow(kept, now);
    }
  }
  places_ = std::move(now);
}

/// Of one that the graph has dropped: goes with the nearest that was there before and still is.
void SurfaceMap::Follow(Kept& kept, const std::map<std::int64_t, KeyframePlace>& now) const {
  if (!kept.anchor || !now.contains(*kept.anchor)) {
    kept.anchor.reset();
    double nearest = std::numeric_limits<double>::max();
    for (const auto& [id, place] : places_) {
      const double apart = ApartBy(kept.place, place, options_);
      if (id == kept.place.id || apart >= nearest || !now.contains(id)) continue;
      nearest = apart;
      kept.anchor = id;
      kept.anchor_place = place;
    }
    if (!kept.anchor) return;
  }
  const KeyframePlace& anchor = now.at(*kept.anchor);
  const double factor = anchor.distance_m / kept.anchor_place.distance_m;
  Rigid3 anchor_from_this =
      kept.anchor_place.world_from_camera.Inverse() * kept.place.world_from_camera;
  anchor_from_this.translation *= factor;
  kept.place.world_from_camera = anchor.world_from_camera * anchor_from_this;
  kept.place.distance_m *= factor;
  kept.anchor_place = anchor;
}

void SurfaceMap::DropOldest() {
  const auto oldest = kept_.begin();
  if (fusion_) fusion_->Remove(oldest->first);
  kept_.erase(oldest);
}

const SurfaceFusion::Chunks& SurfaceMap::chunks() const {
  static const SurfaceFusion::Chunks none;
  return fusion_ ? fusion_->chunks() : none;
}

std::size_t SurfaceMap::bytes() const {
  std::size_t sum = fusion_ ? fusion_->bytes() : 0;
  for (const auto& [id, kept] : kept_) {
    sum += kept.picture.grey.total() * 4 + kept.picture.color.total() * 3;
    if (kept.depth) sum += kept.depth->inverse_depth.total() * 4;
  }
  return sum;
}

std::vector<SurfaceMap::KeptView> SurfaceMap::views() const {
  std::vector<KeptView> views;
  for (const auto& [id, kept] : kept_) {
    views.push_back({kept.place.frame, kept.place.world_from_camera, kept.place.distance_m,
                     &kept.picture, kept.depth ? &*kept.depth : nullptr, LengthFactor(kept)});
  }
  return views;
}

}  // namespace saccade
