#include "server/rpc/deltas.hpp"

#include <cmath>

#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr double kMovedM = 5e-4;
constexpr double kMovedSigmas = 0.1;
constexpr double kChangedShare = 0.1;
constexpr double kMovedPx = 0.25;
constexpr Timestamp kRefreshNs = 200'000'000;

bool ChangedByShare(double now, double before) {
  return std::abs(now - before) > kChangedShare * std::max(now, before);
}

// How far a shift of the point moves its picture, at most [px].
double ShiftPx(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const TrackedEvent& event) {
  const double distance_m = (to - event.snapshot->world_from_camera.translation).norm();
  const double shift_m = (to - from).norm();
  if (shift_m == 0.0) return 0.0;
  return shift_m / std::max(distance_m, 1e-3) / event.camera->RadiansPerPixel();
}

}  // namespace

bool MapDeltaTracker::Upsert(const FeatureSnapshot& feature) {
  const double sigma_m = std::sqrt(std::max(0.0, feature.covariance_in_world.trace()));
  const auto [at, inserted] = sent_.try_emplace(
      feature.id,
      Sent{feature.point_in_world, sigma_m, feature.state, feature.depth_known, round_});
  Sent& sent = at->second;
  sent.round = round_;
  if (inserted) return true;
  const double moved_m = (feature.point_in_world - sent.point_in_world).norm();
  if (feature.state == sent.state && feature.depth_known == sent.depth_known &&
      moved_m <= std::max(kMovedM, kMovedSigmas * sent.sigma_m) &&
      !ChangedByShare(sigma_m, sent.sigma_m)) {
    return false;
  }
  sent = {feature.point_in_world, sigma_m, feature.state, feature.depth_known, round_};
  return true;
}

bool MapDeltaTracker::Next(const MapSnapshot& snapshot, v1::MapDelta& delta) {
  const bool full = first_ || snapshot.map_generation != generation_;
  const bool jumped = snapshot.map_revision != revision_;
  if (full) sent_.clear();
  first_ = false;
  generation_ = snapshot.map_generation;
  revision_ = snapshot.map_revision;
  ++round_;
  delta.Clear();
  delta.set_map_generation(snapshot.map_generation);
  delta.set_map_revision(snapshot.map_revision);
  delta.set_frame_id(snapshot.frame_id);
  delta.set_full(full);
  for (const FeatureSnapshot& feature : snapshot.features) {
    if (Upsert(feature)) *delta.add_upserted() = wire::ToProto(feature);
  }
  absl::erase_if(sent_, [this, &delta](const auto& entry) {
    if (entry.second.round == round_) return false;
    delta.add_removed_ids(entry.first);
    return true;
  });
  return full || jumped || delta.upserted_size() > 0 || delta.removed_ids_size() > 0;
}

bool AnnotationDeltaTracker::Upsert(const Annotation& annotation, const TrackedEvent& event,
                                    Timestamp now_ns) {
  const Anchor& anchor = annotation.anchor;
  const Sent now{annotation.revision,
                 anchor.state,
                 anchor.point_in_world,
                 anchor.error_m,
                 anchor.error_px.has_value(),
                 now_ns,
                 round_};
  const auto [at, inserted] = sent_.try_emplace(annotation.id, now);
  Sent& sent = at->second;
  sent.round = round_;
  if (inserted) return true;
  const bool edited = now.revision != sent.revision || now.state != sent.state;
  const bool moved = ShiftPx(sent.point_in_world, now.point_in_world, event) > kMovedPx;
  const bool aged = now_ns - sent.time_ns >= kRefreshNs &&
                    (now.in_view != sent.in_view || ChangedByShare(now.error_m, sent.error_m));
  if (!edited && !moved && !aged) return false;
  sent = now;
  return true;
}

bool AnnotationDeltaTracker::Next(const TrackedEvent& event, Timestamp now_ns,
                                  v1::AnnotationEvent& delta) {
  const bool full = first_;
  first_ = false;
  ++round_;
  delta.Clear();
  delta.set_full(full);
  for (const Annotation& annotation : *event.annotations) {
    if (Upsert(annotation, event, now_ns)) {
      *delta.add_upserted() = wire::ToProto(annotation);
    }
  }
  absl::erase_if(sent_, [this, &delta](const auto& entry) {
    if (entry.second.round == round_) return false;
    delta.add_removed_ids(entry.first);
    return true;
  });
  return full || delta.upserted_size() > 0 || delta.removed_ids_size() > 0;
}

v1::MapDelta FullMap(const MapSnapshot& snapshot) {
  MapDeltaTracker tracker;
  v1::MapDelta delta;
  tracker.Next(snapshot, delta);
  return delta;
}

}  // namespace saccade
