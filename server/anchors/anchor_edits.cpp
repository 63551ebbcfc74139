// The edits of AnchorManager: create, change, delete, and taking them back.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/edit_checks.hpp"

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

/// Whether `live` is still what `expected` left (both null: it does not exist).
bool IsUnchanged(const AnchorRecord* live, const RecordPtr& expected) {
  if (!live || !expected) return !live && !expected;
  return live->content_id == expected->content_id;
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
  Estimate(record);
  return absl::OkStatus();
}

absl::StatusOr<AnnotationEdit> AnchorManager::Create(const AnnotationDraft& draft,
                                                     const std::string& session_id) {
  if (absl::Status status = CheckDraft(draft); !status.ok()) return status;
  if (records_.size() >= options_.max_annotations) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "there are ", records_.size(), " annotations, as many as are kept; delete some first"));
  }
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
  record.content_id = next_content_++;
  EditStep step{record.annotation.id, nullptr, Copy(&record),
                "created " + ShortName(record.annotation)};
  absl::StatusOr<AnnotationEdit> edit = Apply(EditKind::kCreate, session_id, std::move(step));
  if (edit.ok()) edit->change.request_id = draft.request_id;
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
  if (patch.target) {
    if (absl::Status status = Place(*patch.target, {}, record); !status.ok()) return status;
  }
  record.annotation.revision += 1;
  record.content_id = next_content_++;
  EditStep step{patch.id, Copy(live), Copy(&record),
                (patch.target ? "moved " : "changed ") + ShortName(record.annotation)};
  return Apply(EditKind::kUpdate, session_id, std::move(step));
}

absl::StatusOr<AnnotationEdit> AnchorManager::Delete(const std::string& id,
                                                     const std::string& session_id) {
  const AnchorRecord* live = Find(id);
  if (!live) {
    return absl::NotFoundError(
        absl::StrCat("id '", id, "' is no annotation; list them to see which there are"));
  }
  EditStep step{id, Copy(live), nullptr, "deleted " + ShortName(live->annotation)};
  return Apply(EditKind::kDelete, session_id, std::move(step));
}

/// A new edit: remembered for undo, and what was undone before can no longer be redone.
absl::StatusOr<AnnotationEdit> AnchorManager::Apply(EditKind kind, const std::string& session_id,
                                                    EditStep step) {
  EditHistory history = histories_[session_id];
  history.undone.clear();
  history.done.push_back(step);
  if (history.done.size() > options_.max_undo) history.done.erase(history.done.begin());
  return Commit(kind, session_id, step, std::move(history), step.description);
}

/// Makes `step.after` the live state.
absl::StatusOr<AnnotationEdit> AnchorManager::Commit(EditKind kind, const std::string& session_id,
                                                     const EditStep& step, EditHistory history,
                                                     const std::string& description) {
  const AnchorRecord* live = Find(step.id);
  AnnotationEdit edit;
  edit.change = {next_sequence_++, kind, step.id, session_id, "", description, std::nullopt};
  EditHistory& held = histories_[session_id];
  pending_.push_back({edit.change.sequence, step.id, Copy(live), session_id, held});
  held = std::move(history);
  if (step.after) {
    edit.annotation = step.after->annotation;
    edit.change.after = StoredAnnotation{edit.annotation, step.after->place.world_key};
  } else {
    edit.annotation = live->annotation;
    edit.annotation.anchor.state = AnchorState::kStopped;
    edit.annotation.anchor.reason = "deleted";
  }
  Put(step.id, step.after);
  Publish();
  return edit;
}

absl::StatusOr<AnnotationEdit> AnchorManager::TakeBack(bool undo, const std::string& session_id) {
  EditHistory history = histories_[session_id];
  std::vector<EditStep>& from = undo ? history.done : history.undone;
  std::vector<EditStep>& to = undo ? history.undone : history.done;
  if (from.empty()) {
    return absl::FailedPreconditionError(undo ? "this session has nothing to undo"
                                              : "this session has nothing to redo");
  }
  EditStep step = from.back();
  from.pop_back();
  const AnchorRecord* live = Find(step.id);
  if (!IsUnchanged(live, undo ? step.after : step.before)) {
    histories_[session_id] = std::move(history);
    return absl::FailedPreconditionError(
        absl::StrCat("somebody else changed it since you ", step.description,
                     "; that step is skipped, the one before it is next"));
  }
  const RecordPtr& wanted = undo ? step.before : step.after;
  EditStep apply{step.id, Copy(live), nullptr, ""};
  if (wanted) {
    AnchorRecord restored = *wanted;
    if (live) {
      restored.annotation.revision = live->annotation.revision;
      if (live->place.id == restored.place.id) {  // the place was not part of the edit
        restored.place = live->place;
        restored.annotation.anchor = live->annotation.anchor;
      }
    }
    restored.annotation.revision += 1;
    if (newest_) Estimate(restored);
    apply.after = Copy(&restored);
  }
  (undo ? step.before : step.after) = apply.after;
  (undo ? step.after : step.before) = apply.before;
  to.push_back(step);
  return Commit(undo ? EditKind::kUndo : EditKind::kRedo, session_id, apply, std::move(history),
                absl::StrCat(undo ? "took back: " : "did again: ", step.description));
}

absl::StatusOr<AnnotationEdit> AnchorManager::Undo(const std::string& session_id) {
  return TakeBack(true, session_id);
}

absl::StatusOr<AnnotationEdit> AnchorManager::Redo(const std::string& session_id) {
  return TakeBack(false, session_id);
}

void AnchorManager::Put(const std::string& id, const RecordPtr& record) {
  AnchorRecord* live = Find(id);
  if (!record) {
    if (live) records_.erase(records_.begin() + (live - records_.data()));
  } else if (live) {
    *live = *record;
  } else {
    const auto later = [&record](const AnchorRecord& other) {
      return other.annotation.created_unix_ns > record->annotation.created_unix_ns;
    };
    records_.insert(std::find_if(records_.begin(), records_.end(), later), *record);
  }
}

void AnchorManager::ForgetSession(const std::string& session_id) { histories_.erase(session_id); }

void AnchorManager::Committed(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.front().sequence <= sequence) pending_.pop_front();
}

void AnchorManager::RollBack(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.back().sequence > sequence) {
    PendingEdit& edit = pending_.back();
    Put(edit.id, edit.before);
    histories_[edit.session_id] = std::move(edit.history_before);
    pending_.pop_back();
  }
  Publish();
}

}  // namespace saccade
