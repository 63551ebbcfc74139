#include "client/session/marker_fixing.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

namespace saccade::session {
namespace {

constexpr Timestamp kSeenNs = 6'000'000'000;

std::string MarkerName(const SceneObject& thing) {
  return absl::StrCat(thing.marker_family, " ", thing.marker_id);
}

}  // namespace

const MarkerPose* FindMarker(std::span<const MarkerPose> markers, const std::string& family,
                             std::uint32_t id) {
  const auto found = std::ranges::find_if(
      markers, [&](const MarkerPose& one) { return one.family == family && one.id == id; });
  return found == markers.end() ? nullptr : &*found;
}

void MarkerFixing::Fix(const SceneObject& thing, const Marker& marker,
                       const Rigid3& world_from_thing, ThingEdits::Done done) {
  if (marker.family.empty() || !(marker.side_m > 0)) {
    return done(absl::InvalidArgumentError(
        "give the number of the marker and the side of its black border in metres"));
  }
  SceneObject fixed = thing;
  fixed.parent = SceneParent::kMarker;
  fixed.marker_family = marker.family;
  fixed.marker_id = marker.id;
  fixed.marker_side_m = marker.side_m;
  fixed.annotation_id.clear();
  fixed.parent_from_object = Rigid3();
  // The server looks for markers that something is fixed to: it is told of it first.
  edits_.Put(
      fixed, [](const SceneObject&) { return std::string(); },
      [this, fixed, world_from_thing, done](const absl::StatusOr<ThingEdits::Told>& told) {
        if (!told.ok()) return done(told);
        waiting_ = Waiting{fixed, world_from_thing, MonotonicNow() + kSeenNs, done};
      });
}

void MarkerFixing::Check(Timestamp now_ns, std::span<const MarkerPose> markers) {
  if (!waiting_) return;
  const MarkerPose* seen =
      FindMarker(markers, waiting_->thing.marker_family, waiting_->thing.marker_id);
  if (seen == nullptr && now_ns < waiting_->until_ns) return;
  Waiting waiting = *std::exchange(waiting_, std::nullopt);
  const std::string marker = MarkerName(waiting.thing);
  if (seen != nullptr) {
    waiting.thing.parent_from_object = seen->world_from_marker.Inverse() * waiting.world_from_thing;
    return edits_.Put(
        waiting.thing,
        [marker](const SceneObject& put) { return absl::StrCat(put.name, " moves with ", marker); },
        waiting.done, true);
  }
  edits_.Undo([marker, done = waiting.done](const absl::StatusOr<ThingEdits::Told>& undone) {
    if (!undone.ok()) return done(undone);
    done(absl::DeadlineExceededError(absl::StrCat(
        marker, " was not seen within ", kSeenNs / 1'000'000'000, " s; show it to the camera")));
  });
}

void MarkerFixing::LetGo(SceneObject thing, const Rigid3& world_from_thing, ThingEdits::Done done) {
  thing.parent = SceneParent::kWorld;
  thing.parent_from_object = world_from_thing;
  edits_.Put(
      thing, [](const SceneObject& put) { return absl::StrCat(put.name, " stands by itself"); },
      std::move(done));
}

}  // namespace saccade::session
