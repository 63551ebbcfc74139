#include "server/anchors/anchor_manager.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/anchors/anchor_state.hpp"
#include "server/anchors/edit_checks.hpp"
#include "server/anchors/measure.hpp"

namespace saccade {
namespace {

constexpr double kStoreAgainM = 0.01;               // an anchor that moved by this is stored again
constexpr Timestamp kStoreAgainNs = 2'000'000'000;  // at most this often
// Searching a map of 3000 landmarks takes some 30 us: a thousand anchors that are due at once (all
// that a restart finds again) take their turns over a second.
constexpr int kSelectionsPerFrame = 32;
// A length is told anew when its end moved by a sixth of a pixel, or every so often when it changed
// at all.
constexpr double kTellShare = 3e-4;  // of the distance
constexpr Timestamp kTellAgainNs = 200'000'000;
constexpr double kTellSigmaShare = 0.1;

}  // namespace

AnchorManager::AnchorManager(AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed)
    : options_(std::move(options)),
      frames_(std::move(frames)),
      seed_(std::move(seed)),
      histories_({.steps = options_.max_undo,
                  .bytes_per_person = options_.max_undo_bytes,
                  .bytes = options_.max_undo_bytes_all}),
      latest_(std::make_shared<const std::vector<Annotation>>()) {}

void AnchorManager::Load(std::vector<StoredAnnotation> stored, std::uint32_t last_pin) {
  last_pin_ = std::max(last_pin_, last_pin);
  for (StoredAnnotation& item : stored) {
    AnchorRecord record;
    record.annotation = std::move(item.annotation);
    record.content_id = next_content_++;
    record.place.id = record.content_id;
    record.place.world_key = std::move(item.world_key);
    record.place.method = record.annotation.anchor.method;
    record.annotation.anchor =
        DescribeDetached(MapSnapshot{}, options_, record.place, record.annotation.anchor);
    record.stored_point = record.annotation.anchor.point_in_world;
    record.stored_error_m = record.annotation.anchor.error_m;
    last_pin_ = std::max(last_pin_, record.annotation.number);
    if (record.annotation.shape == AnnotationShape::kMeasure) {
      record.end.emplace();
      record.end->place = record.place;
      record.end->anchor = record.annotation.anchor;
      record.end->anchor.point_in_world += record.annotation.ink_offset_m[0];
      record.end->anchor.covariance_in_world = item.end_covariance_in_world;
    }
    records_.push_back(std::move(record));
  }
  std::stable_sort(records_.begin(), records_.end(), [](const auto& a, const auto& b) {
    return CreatedBefore(a.annotation, b.annotation);
  });
  Publish();
}

/// A place from another run or an earlier map: found again where the same target gave the world, or
/// where it is the same map.
bool AnchorManager::Attach(const Anchor& last, AnchorPlace& place) const {
  const MapSnapshot& snapshot = newest_->snapshot();
  const bool by_target = snapshot.metric && place.world_key == options_.world_key;
  const bool by_map = place.world_key == options_.map_key;
  if (place.world_key.empty() || !(by_target || by_map) ||
      snapshot.status != TrackingStatus::kTracking || !last.point_in_world.allFinite() ||
      !last.covariance_in_world.allFinite()) {
    return false;
  }
  AnchorPlace fresh;
  fresh.id = place.id;
  fresh.map_generation = snapshot.map_generation;
  fresh.attached = true;
  fresh.world_key = place.world_key;
  fresh.method = place.method;
  fresh.point = fresh.clicked_point = last.point_in_world;
  fresh.clicked_covariance = last.covariance_in_world;
  fresh.distance_m =
      std::max(0.1, (last.point_in_world - snapshot.world_from_camera.translation).norm());
  place = std::move(fresh);
  return true;
}

/// Nothing while it does not hang in this map.
std::optional<PlaceEstimate> AnchorManager::EstimatePlace(AnchorPlace& place, Anchor& anchor,
                                                          int& selections_left) const {
  const MapSnapshot& snapshot = newest_->snapshot();
  if (place.map_generation != snapshot.map_generation) place.attached = false;
  if (!place.attached && (selections_left <= 0 || !Attach(anchor, place))) {
    anchor = DescribeDetached(snapshot, options_, place, anchor);
    return std::nullopt;
  }
  const PlaceEstimate estimate = Follow(*newest_, options_, place, selections_left);
  anchor = DescribeAnchor(*newest_, *camera_, options_, estimate, place);
  return estimate;
}

void AnchorManager::Estimate(AnchorRecord& record, int& selections_left) const {
  Anchor& anchor = record.annotation.anchor;
  const std::optional<PlaceEstimate> at_anchor =
      EstimatePlace(record.place, anchor, selections_left);
  if (!record.end) return;
  const std::optional<PlaceEstimate> at_end =
      EstimatePlace(record.end->place, record.end->anchor, selections_left);
  if (at_anchor && at_end) TellLength(*at_anchor, *at_end, record);
  anchor = JoinEnds(anchor, record.end->anchor);
}

/// Not with each frame: what is told of a mark, but for its anchor, goes out whole.
void AnchorManager::TellLength(const PlaceEstimate& at_anchor, const PlaceEstimate& at_end,
                               AnchorRecord& record) const {
  Annotation& annotation = record.annotation;
  MeasureEnd& end = *record.end;
  const Timestamp now_ns = newest_->snapshot().capture_time_ns;
  const Measured measured = MeasureBetween(*newest_, record.place, at_anchor, end.place, at_end);
  if (end.told_ns != 0 && !annotation.ink_offset_m.empty()) {
    const double moved_m = (measured.offset_in_world - annotation.ink_offset_m[0]).norm();
    const double limit_m = kTellShare * std::min(record.place.distance_m, end.place.distance_m);
    const double sigma_m = std::max(measured.sigma_m, annotation.length_sigma_m);
    const bool differs =
        moved_m > 0.1 * limit_m ||
        std::abs(measured.sigma_m - annotation.length_sigma_m) > kTellSigmaShare * sigma_m;
    const bool due = std::abs(now_ns - end.told_ns) >= kTellAgainNs;
    if (moved_m <= limit_m && !(due && differs)) return;
  }
  end.told_ns = now_ns;
  annotation.ink_offset_m = InkStroke({measured.offset_in_world});
  annotation.length_m = measured.length_m;
  annotation.length_sigma_m = measured.sigma_m;
}

std::optional<AnchorMoved> AnchorManager::ResolveOne(bool map_corrected, AnchorRecord& record,
                                                     int& selections_left) const {
  const Eigen::Vector3d before = record.annotation.anchor.point_in_world;
  const bool was_attached = record.place.attached;
  Estimate(record, selections_left);
  const Eigen::Vector3d delta = record.annotation.anchor.point_in_world - before;
  const double limit =
      newest_->snapshot().metric ? options_.moved_m : options_.moved_m * record.place.distance_m;
  if (!was_attached || !(delta.norm() > limit)) return std::nullopt;
  return AnchorMoved{record.annotation.id, delta,
                     map_corrected ? "the map was corrected" : "the map near it was refined"};
}

std::vector<AnchorMoved> AnchorManager::Resolve(std::shared_ptr<const MapSnapshot> snapshot,
                                                const CameraModel& camera) {
  const bool corrected = newest_ && newest_->snapshot().map_revision != snapshot->map_revision;
  scale_.Observe(*snapshot, camera.RadiansPerPixel());
  trail_.Add(*snapshot);
  newest_ = std::make_shared<const MapView>(std::move(snapshot), &scale_, &trail_, surface_);
  camera_ = camera;
  std::vector<AnchorMoved> moved;
  int selections_left = kSelectionsPerFrame;
  bool looked = false;
  for (AnchorRecord& record : records_) {
    for (AnchorPlace* place : {&record.place, record.end ? &record.end->place : nullptr}) {
      if (looked || !place || !place->look) continue;
      const double age_s = Seconds(newest_->snapshot().capture_time_ns - place->placed_ns);
      looked = LookAgain(frames_, &trail_, newest_->snapshot(), age_s, place->look, place->doubt);
    }
    if (std::optional<AnchorMoved> jump = ResolveOne(corrected, record, selections_left)) {
      moved.push_back(std::move(*jump));
    }
  }
  Publish();
  return moved;
}

std::vector<AnnotationChange> AnchorManager::TakeRefinements() {
  std::vector<AnnotationChange> changes;
  if (!newest_) return changes;
  const Timestamp now_ns = newest_->snapshot().capture_time_ns;
  for (AnchorRecord& record : records_) {
    const Anchor& anchor = record.annotation.anchor;
    if (record.stored_time_ns == 0) {  // just placed or loaded: the edit itself stored it
      record.stored_time_ns = now_ns;
      record.stored_point = anchor.point_in_world;
      record.stored_error_m = anchor.error_m;
    }
    const bool differs = (anchor.point_in_world - record.stored_point).norm() > kStoreAgainM ||
                         anchor.error_m < 0.5 * record.stored_error_m;
    // What is new and not trusted yet is refined all the same; what was sure once waits until it is
    // sure again.
    const bool unsure = newest_->snapshot().status != TrackingStatus::kTracking ||
                        (record.place.was_tracking && anchor.state == AnchorState::kPaused);
    if (!record.place.attached || unsure || !differs ||
        std::abs(now_ns - record.stored_time_ns) < kStoreAgainNs) {
      continue;
    }
    record.stored_time_ns = now_ns;
    record.stored_point = anchor.point_in_world;
    record.stored_error_m = anchor.error_m;
    changes.push_back({next_sequence_++, EditKind::kRefine, record.annotation.id, "", "", "",
                       "refined " + ShortName(record.annotation), Stored(record)});
  }
  return changes;
}

void AnchorManager::Publish() {
  auto list = std::make_shared<std::vector<Annotation>>();
  list->reserve(records_.size());
  for (const AnchorRecord& record : records_) list->push_back(record.annotation);
  const std::lock_guard lock(latest_mutex_);
  latest_ = std::move(list);
}

std::shared_ptr<const std::vector<Annotation>> AnchorManager::Latest() const {
  const std::lock_guard lock(latest_mutex_);
  return latest_;
}

}  // namespace saccade
