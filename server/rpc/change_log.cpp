#include "server/rpc/change_log.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace saccade {
namespace {

constexpr double kMovedM = 5e-4;
constexpr double kMovedSigmas = 0.1;
constexpr double kChangedShare = 0.1;
constexpr double kMovedPx = 0.25;
constexpr Timestamp kRefreshNs = 200'000'000;
constexpr Timestamp kWordsRefreshNs = 1'000'000'000;

bool ChangedByShare(double now, double before) {
  return std::abs(now - before) > kChangedShare * std::max(now, before);
}

// How far a shift of the point moves its picture, at most [px].
double ShiftPx(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const TrackedEvent& event) {
  const double shift_m = (to - from).norm();
  if (shift_m == 0.0) return 0.0;
  const double distance_m = (to - event.snapshot->world_from_camera.translation).norm();
  return shift_m / std::max(distance_m, 1e-3) / event.camera->RadiansPerPixel();
}

bool SameTurn(const Annotation& a, const Annotation& b) {
  if (!a.world_from_mark || !b.world_from_mark) return !a.world_from_mark && !b.world_from_mark;
  return a.world_from_mark->coeffs() == b.world_from_mark->coeffs();
}

// Not the revision alone: an edit that the disk refused is taken back, and its number used again.
bool SameContent(const Annotation& a, const Annotation& b) {
  return a.revision == b.revision && a.ink_offset_m.identity() == b.ink_offset_m.identity() &&
         a.text == b.text && a.color_rgba == b.color_rgba && a.size_m == b.size_m &&
         a.locked == b.locked && a.extent_m == b.extent_m && SameTurn(a, b) &&
         a.length_m == b.length_m && a.length_sigma_m == b.length_sigma_m &&
         a.check_items == b.check_items && a.picture == b.picture;
}

bool EstimateChanged(const Annotation& now, const Annotation& sent, Timestamp age_ns,
                     const TrackedEvent& event) {
  const Anchor& anchor = now.anchor;
  if (anchor.state != sent.anchor.state || anchor.place_known != sent.anchor.place_known) {
    return true;
  }
  if (ShiftPx(sent.anchor.point_in_world, anchor.point_in_world, event) > kMovedPx) return true;
  // Words hold figures that change all the time.
  if (age_ns >= kWordsRefreshNs && anchor.reason != sent.anchor.reason) return true;
  return age_ns >= kRefreshNs && (anchor.error_px.has_value() != sent.anchor.error_px.has_value() ||
                                  ChangedByShare(anchor.error_m, sent.anchor.error_m));
}

// Numbers the removals. `sent` is what is known of the items, each with the round it was last seen
// in: what is not of `round` is gone. `returned`: ids that were removed once and are there again.
template <typename Id, typename Sent>
void Remove(absl::flat_hash_map<Id, Sent>& sent, std::uint64_t round,
            const std::vector<Id>& returned, Changes<Id>& changes) {
  std::vector<Removal<Id>> gone;
  absl::erase_if(sent, [&](const auto& entry) {
    if (entry.second.round == round) return false;
    gone.push_back({++changes.newest, entry.first});
    return true;
  });
  if (gone.empty() && returned.empty()) return;
  auto removed = std::make_shared<std::vector<Removal<Id>>>(*changes.removed);
  for (const Id& id : returned) {  // there again: its own change says so
    std::erase_if(*removed, [&id](const Removal<Id>& removal) { return removal.id == id; });
  }
  removed->insert(removed->end(), gone.begin(), gone.end());
  if (removed->size() > ChangeLog::kKeptRemovals) {
    const auto kept = removed->end() - ChangeLog::kKeptRemovals / 2;
    changes.forgotten = (kept - 1)->number;
    removed->erase(removed->begin(), kept);
  }
  changes.removed = std::move(removed);
}

// The changes of a state that follows `before` (null: of the first one), still without any.
template <typename Id>
std::shared_ptr<Changes<Id>> After(const std::shared_ptr<const Changes<Id>>& before,
                                   ChangeNumber newest, std::size_t items) {
  auto changes = std::make_shared<Changes<Id>>();
  changes->newest = changes->previous = newest;
  changes->removed = before ? before->removed : std::make_shared<const std::vector<Removal<Id>>>();
  changes->forgotten = before ? before->forgotten : 0;
  changes->numbers.reserve(items);
  changes->content_numbers.reserve(items);
  return changes;
}

template <typename Id>
bool WasRemoved(const Changes<Id>& changes, const Id& id) {
  return std::any_of(changes.removed->begin(), changes.removed->end(),
                     [&id](const Removal<Id>& removal) { return removal.id == id; });
}

}  // namespace

NumberedState ChangeLog::Next(const TrackedEvent& event, Timestamp now_ns) {
  ++round_;
  return {event, NextMap(*event.snapshot), NextAnnotations(event, now_ns)};
}

std::shared_ptr<const Changes<FeatureId>> ChangeLog::NextMap(const MapSnapshot& snapshot) {
  if (map_changes_ && snapshot.map_generation != generation_) {
    features_.clear();
    map_changes_ = nullptr;  // ids mean something else now: nothing of before is a removal
  }
  generation_ = snapshot.map_generation;
  auto changes = After(map_changes_, map_newest_, snapshot.features.size());
  std::vector<FeatureId> returned;
  for (const FeatureSnapshot& feature : snapshot.features) {
    const double sigma_m = std::sqrt(std::max(0.0, feature.covariance_in_world.trace()));
    const ChangeNumber next = changes->newest + 1;
    SentFeature now{
        feature.point_in_world, sigma_m, feature.state, feature.depth_known, next, next, round_};
    const auto [at, inserted] = features_.try_emplace(feature.id, now);
    SentFeature& sent = at->second;
    sent.round = round_;
    const double moved_m = (feature.point_in_world - sent.point_in_world).norm();
    if (inserted || feature.state != sent.state || feature.depth_known != sent.depth_known ||
        moved_m > std::max(kMovedM, kMovedSigmas * sent.sigma_m) ||
        ChangedByShare(sigma_m, sent.sigma_m)) {
      if (inserted && WasRemoved(*changes, feature.id)) returned.push_back(feature.id);
      now.content_number = sent.content_number;
      sent = now;
      changes->changed.push_back(static_cast<std::uint32_t>(changes->numbers.size()));
      ++changes->newest;
    }
    changes->numbers.push_back(sent.number);
    changes->content_numbers.push_back(sent.content_number);
  }
  Remove(features_, round_, returned, *changes);
  map_newest_ = changes->newest;
  return map_changes_ = std::move(changes);
}

std::shared_ptr<const Changes<std::string>> ChangeLog::NextAnnotations(const TrackedEvent& event,
                                                                       Timestamp now_ns) {
  auto changes = After(annotation_changes_, annotations_newest_, event.annotations->size());
  std::vector<std::string> returned;
  for (const Annotation& annotation : *event.annotations) {
    const auto [at, inserted] = annotations_.try_emplace(annotation.id);
    SentAnnotation& sent = at->second;
    sent.round = round_;
    const bool edited = inserted || !SameContent(annotation, sent.annotation);
    if (edited || EstimateChanged(annotation, sent.annotation, now_ns - sent.time_ns, event)) {
      if (inserted && WasRemoved(*changes, annotation.id)) returned.push_back(annotation.id);
      sent.annotation = annotation;
      sent.time_ns = now_ns;
      sent.number = ++changes->newest;
      if (edited) sent.content_number = sent.number;
      changes->changed.push_back(static_cast<std::uint32_t>(changes->numbers.size()));
    }
    changes->numbers.push_back(sent.number);
    changes->content_numbers.push_back(sent.content_number);
  }
  Remove(annotations_, round_, returned, *changes);
  annotations_newest_ = changes->newest;
  return annotation_changes_ = std::move(changes);
}

}  // namespace saccade
