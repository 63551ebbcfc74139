// The edits of AnchorManager: create, change, delete, and taking them back.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/edit_checks.hpp"
#include "server/anchors/quota.hpp"

namespace saccade {
namespace {

std::int64_t UnixNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

RecordPtr Copy(const AnchorRecord* record) {
  return record ? std::make_shared<const AnchorRecord>(*record) : nullptr;
}

}  // namespace

AnchorRecord* AnchorManager::Find(const std::string& id) {
  const auto same = [&id](const AnchorRecord& record) { return record.annotation.id == id; };
  const auto found = std::find_if(records_.begin(), records_.end(), same);
  return found == records_.end() ? nullptr : &*found;
}

std::optional<Annotation> AnchorManager::Get(const std::string& id) const {
  for (const AnchorRecord& record : records_) {
    if (record.annotation.id == id) return record.annotation;
  }
  return std::nullopt;
}

absl::Status AnchorManager::CheckReady() const {
  if (newest_) return absl::OkStatus();
  return absl::FailedPreconditionError("no frame has been tracked yet; wait for video");
}

/// Gives `record` a new place at `target`.
absl::Status AnchorManager::Place(const AnnotationTarget& target,
                                  const std::vector<Eigen::Vector2d>& ink_px,
                                  AnchorRecord& record) {
  if (absl::Status status = CheckReady(); !status.ok()) return status;
  absl::StatusOr<ResolvedTarget> resolved = ResolveTarget(target, frames_, *newest_, options_);
  if (!resolved.ok()) return resolved.status();
  const MapSnapshot& snapshot = newest_->snapshot();
  AnchorPlace place;
  place.id = next_content_;
  place.map_generation = snapshot.map_generation;
  place.attached = true;
  place.world_key = snapshot.metric ? options_.world_key : "";
  place.method = resolved->method;
  place.point = place.clicked_point = resolved->point_in_world;
  place.clicked_covariance = resolved->covariance_in_world;
  place.distance_m = resolved->distance_m;
  place.seed = resolved->feature;
  place.seed_is_target = resolved->feature_is_target;
  place.doubt = resolved->doubt;
  if (resolved->view) {
    const ResolvedTarget::View& view = *resolved->view;
    place.clicked_from = view.world_from_camera.translation;
    place.doubt_ray = (place.point - place.clicked_from).normalized();
    if (place.doubt.surface == ClickSurface::kUnknown) {
      place.look = {view.past.frame->id, view.pixel, view.depth_m};
    }
  }
  if (!place.seed && resolved->view && seed_) {
    const ResolvedTarget::View& view = *resolved->view;
    // The feature is to find the depth by itself: neighbours only tell it where to begin.
    const double sigma_m = std::clamp(3.0 * view.depth_sigma_m, 0.1 * view.depth_m,
                                      options_.median_depth_sigma * view.depth_m);
    const absl::StatusOr<FeatureId> feature =
        seed_(*view.past.frame, view.world_from_camera, view.pixel, view.depth_m, sigma_m);
    if (feature.ok()) place.seed = *feature;
  }
  record.place = std::move(place);
  if (record.annotation.shape == AnnotationShape::kInk && !ink_px.empty()) {
    record.annotation.ink_offset_m = ProjectInk(ink_px, *resolved);
  }
  int selections_left = 1;
  Estimate(record, selections_left);
  return absl::OkStatus();
}

absl::StatusOr<AnnotationEdit> AnchorManager::Create(const AnnotationDraft& draft,
                                                     const std::string& session_id) {
  if (absl::Status status = CheckDraft(draft); !status.ok()) return status;
  const Holding added{
      1, draft.ink_px.size(),
      draft.text.size() + draft.author.size() + draft.ink_px.size() * sizeof(Eigen::Vector3d)};
  absl::Status fits = CheckQuotas(records_, options_, session_id, added);
  if (!fits.ok()) return fits;
  AnchorRecord record;
  record.annotation.id = MakeUuid();
  record.annotation.shape = draft.shape;
  record.annotation.text = draft.text;
  record.annotation.author = draft.author;
  record.annotation.size_m = draft.size_m;
  record.annotation.color_rgba = draft.color_rgba;
  record.annotation.created_unix_ns = UnixNow();
  record.annotation.revision = 1;
  if (absl::Status status = Place(draft.target, draft.ink_px, record); !status.ok()) return status;
  record.owner = session_id;
  record.content_id = next_content_++;
  AnnotationEdit edit =
      Apply(EditKind::kCreate, session_id, nullptr, &record, /*touches_place=*/true, "created");
  edit.change.request_id = draft.request_id;
  return edit;
}

absl::StatusOr<AnnotationEdit> AnchorManager::Update(const AnnotationPatch& patch,
                                                     const std::string& session_id) {
  if (absl::Status status = CheckPatch(patch); !status.ok()) return status;
  const AnchorRecord* live = Find(patch.id);
  if (!live) {
    return absl::NotFoundError(
        absl::StrCat("id '", patch.id, "' is no annotation; list them to see which there are"));
  }
  AnchorRecord record = *live;
  if (patch.text) record.annotation.text = *patch.text;
  if (patch.size_m) record.annotation.size_m = *patch.size_m;
  if (patch.color_rgba) record.annotation.color_rgba = *patch.color_rgba;
  if (absl::Status fits = CheckGrowth(live, record.annotation, session_id); !fits.ok()) return fits;
  if (patch.target) {
    if (absl::Status status = Place(*patch.target, {}, record); !status.ok()) return status;
  }
  record.annotation.revision += 1;
  record.content_id = next_content_++;
  return Apply(EditKind::kUpdate, session_id, live, &record,
               /*touches_place=*/patch.target.has_value(), patch.target ? "moved" : "changed");
}

absl::StatusOr<AnnotationEdit> AnchorManager::Delete(const std::string& id,
                                                     const std::string& session_id) {
  const AnchorRecord* live = Find(id);
  if (!live) {
    return absl::NotFoundError(
        absl::StrCat("id '", id, "' is no annotation; list them to see which there are"));
  }
  return Apply(EditKind::kDelete, session_id, live, nullptr, /*touches_place=*/true, "deleted");
}

/// Whether `wanted` fits into the quotas in place of `live` (null: it is new).
absl::Status AnchorManager::CheckGrowth(const AnchorRecord* live, const Annotation& wanted,
                                        const std::string& owner) const {
  Holding added = HoldingOf(wanted);
  if (live) {
    const Holding had = HoldingOf(live->annotation);
    added.annotations -= had.annotations;
    added.ink_points -= std::min(added.ink_points, had.ink_points);
    added.bytes -= std::min(added.bytes, had.bytes);
  }
  return CheckQuotas(records_, options_, owner, added);
}

/// A new edit: remembered for undo, and what was undone before can no longer be redone.
AnnotationEdit AnchorManager::Apply(EditKind kind, const std::string& session_id,
                                    const AnchorRecord* before, const AnchorRecord* after,
                                    bool touches_place, const std::string& verb) {
  const Annotation& annotation = (after ? after : before)->annotation;
  EditHistory history = histories_.Get(session_id);
  auto step = std::make_shared<EditStep>();
  step->id = annotation.id;
  step->description = absl::StrCat(verb, " ", ShortName(annotation));
  step->touches_place = touches_place;
  step->number = next_step_++;
  if (!touches_place) step->before = LastLeft(history, before);
  if (!step->before) step->before = Past(before, touches_place);
  step->after = Past(after, touches_place);
  history.undone.clear();
  history.done.push_back(step);
  return Commit(kind, session_id, step->id, after, std::move(history), step->description);
}

/// Makes `after` (null: nothing) the live state of `id`.
AnnotationEdit AnchorManager::Commit(EditKind kind, const std::string& session_id,
                                     const std::string& id, const AnchorRecord* after,
                                     EditHistory history, const std::string& description) {
  const AnchorRecord* live = Find(id);
  AnnotationEdit edit;
  edit.change = {next_sequence_++, kind, id, session_id, "", description, std::nullopt};
  pending_.push_back(
      {edit.change.sequence, id, Copy(live), session_id, histories_.Get(session_id)});
  histories_.Set(session_id, std::move(history));
  if (after) {
    edit.annotation = after->annotation;
    edit.change.after = StoredAnnotation{edit.annotation, after->place.world_key};
  } else {
    edit.annotation = live->annotation;
    edit.annotation.anchor.state = AnchorState::kStopped;
    edit.annotation.anchor.reason = "deleted";
  }
  Put(id, after);
  Publish();
  return edit;
}

absl::StatusOr<AnnotationEdit> AnchorManager::TakeBack(bool undo, const std::string& session_id) {
  EditHistory history = histories_.Get(session_id);
  std::vector<EditStepPtr>& from = undo ? history.done : history.undone;
  std::vector<EditStepPtr>& to = undo ? history.undone : history.done;
  if (from.empty()) {
    return absl::FailedPreconditionError(undo ? "this session has nothing to undo"
                                              : "this session has nothing to redo");
  }
  const EditStepPtr step = from.back();
  from.pop_back();
  const AnchorRecord* live = Find(step->id);
  if (!IsUnchanged(live, undo ? step->after : step->before)) {
    histories_.Set(session_id, std::move(history));
    return absl::FailedPreconditionError(
        absl::StrCat("somebody else changed it since you ", step->description,
                     "; that step is skipped, the one before it is next"));
  }
  const PastStatePtr& wanted = undo ? step->before : step->after;
  std::optional<AnchorRecord> restored;
  if (wanted) {
    absl::Status fits =
        CheckGrowth(live, wanted->annotation, wanted->owner == session_id ? session_id : "");
    if (!fits.ok()) return fits;
    restored = Restore(*wanted, live);
  }
  EditStepPtr turned = step;
  if (step->touches_place) {  // places move on with the map: these are the ones to come back to
    auto fresh = std::make_shared<EditStep>(*step);
    (undo ? fresh->before : fresh->after) = Past(restored ? &*restored : nullptr, true);
    (undo ? fresh->after : fresh->before) = Past(live, true);
    turned = std::move(fresh);
  }
  to.push_back(std::move(turned));
  return Commit(undo ? EditKind::kUndo : EditKind::kRedo, session_id, step->id,
                restored ? &*restored : nullptr, std::move(history),
                absl::StrCat(undo ? "took back: " : "did again: ", step->description));
}

/// `past` as a live record, in place of `live` (null: it does not exist any more).
AnchorRecord AnchorManager::Restore(const PastState& past, const AnchorRecord* live) const {
  AnchorRecord record = live ? *live : AnchorRecord{};
  const Anchor anchor = record.annotation.anchor;
  const std::uint64_t revision = (live ? *live : record).annotation.revision;
  record.annotation = past.annotation;
  record.content_id = past.content_id;
  record.owner = past.owner;
  if (live) record.annotation.revision = revision;
  record.annotation.revision += 1;
  if (live && (!past.place || live->place.id == past.place->id)) {
    record.annotation.anchor = anchor;  // the place was not part of the edit
  } else if (past.place) {
    record.place = *past.place;
  }
  int selections_left = 1;
  if (newest_) Estimate(record, selections_left);
  return record;
}

absl::StatusOr<AnnotationEdit> AnchorManager::Undo(const std::string& session_id) {
  return TakeBack(true, session_id);
}

absl::StatusOr<AnnotationEdit> AnchorManager::Redo(const std::string& session_id) {
  return TakeBack(false, session_id);
}

void AnchorManager::Put(const std::string& id, const AnchorRecord* record) {
  AnchorRecord* live = Find(id);
  if (!record) {
    if (live) records_.erase(records_.begin() + (live - records_.data()));
  } else if (live) {
    *live = *record;
  } else {
    const auto later = [record](const AnchorRecord& other) {
      return CreatedBefore(record->annotation, other.annotation);
    };
    records_.insert(std::find_if(records_.begin(), records_.end(), later), *record);
  }
}

void AnchorManager::ForgetSession(const std::string& session_id) { histories_.Forget(session_id); }

void AnchorManager::Committed(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.front().sequence <= sequence) pending_.pop_front();
}

void AnchorManager::RollBack(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.back().sequence > sequence) {
    PendingEdit& edit = pending_.back();
    Put(edit.id, edit.before.get());
    histories_.Set(edit.session_id, std::move(edit.history_before));
    pending_.pop_back();
  }
  Publish();
}

}  // namespace saccade
