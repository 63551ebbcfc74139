// What AnchorManager does with an edit: makes it live, remembers it for undo, takes it back.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/edit_checks.hpp"
#include "server/anchors/quota.hpp"

namespace saccade {
namespace {

RecordPtr Copy(const AnchorRecord* record) {
  return record ? std::make_shared<const AnchorRecord>(*record) : nullptr;
}

std::uint64_t EndId(const MeasureEnd* end) { return end ? end->place.id : 0; }

std::string NameOf(const EditStep& step) {
  return ShortName((step.after ? step.after : step.before)->annotation);
}

/// What of a group stays as it is, and why; empty if all went.
std::string SayKept(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 3;
  if (names.empty()) return "";
  std::string text = "; somebody else changed since, and so stays: ";
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
    absl::StrAppend(&text, i > 0 ? ", " : "", names[i]);
  }
  if (names.size() > kNamed) absl::StrAppend(&text, " and ", names.size() - kNamed, " more");
  return text;
}

}  // namespace

/// Whether `wanted` fits into the quotas in place of `live` (null: it is new).
absl::Status AnchorManager::CheckGrowth(const AnchorRecord* live, const Annotation& wanted,
                                        const std::string& person_id) const {
  Holding added = HoldingOf(wanted);
  if (live) {
    const Holding had = HoldingOf(live->annotation);
    added.annotations -= had.annotations;
    added.ink_points -= std::min(added.ink_points, had.ink_points);
    added.bytes -= std::min(added.bytes, had.bytes);
    added.picture_bytes -= std::min(added.picture_bytes, had.picture_bytes);
  }
  return CheckQuotas(records_, options_, person_id, added);
}

/// A new edit: remembered for undo, and what was undone before can no longer be redone.
AnnotationEdit AnchorManager::Apply(EditKind kind, const Editor& editor, const AnchorRecord* before,
                                    const AnchorRecord* after, bool touches_place,
                                    const std::string& verb) {
  const Annotation& annotation = (after ? after : before)->annotation;
  EditHistory history = histories_.Get(editor.person_id);
  auto step = std::make_shared<EditStep>();
  step->id = annotation.id;
  step->description = absl::StrCat(verb, " ", ShortName(annotation));
  step->touches_place = touches_place;
  step->number = next_step_++;
  if (!editor.edit_group.empty()) {
    step->group = absl::StrCat(editor.participant_id, "/", editor.edit_group);
  }
  if (!touches_place) step->before = LastLeft(history, before);
  if (!step->before) step->before = Past(before, touches_place);
  step->after = Past(after, touches_place);
  const std::string id = step->id, description = step->description;
  AddStep(std::move(step), before, after, history);
  return Commit(kind, editor, id, after, std::move(history), description);
}

/// Makes `after` (null: nothing) the live state of `id`.
AnnotationEdit AnchorManager::Commit(EditKind kind, const Editor& editor, const std::string& id,
                                     const AnchorRecord* after, EditHistory history,
                                     const std::string& description) {
  const AnchorRecord* live = Find(id);
  AnnotationEdit edit;
  edit.description = description;
  edit.change = {next_sequence_++, kind, id,          editor.participant_id,
                 editor.person_id, "",   description, std::nullopt};
  pending_.push_back(
      {edit.change.sequence, id, Copy(live), editor.person_id, histories_.Get(editor.person_id)});
  histories_.Set(editor.person_id, std::move(history));
  if (after) {
    edit.annotation = after->annotation;
    edit.change.after = Stored(*after);
  } else {
    edit.annotation = live->annotation;
    edit.annotation.anchor.state = AnchorState::kStopped;
    edit.annotation.anchor.reason = "deleted";
  }
  Put(id, after);
  Publish();
  return edit;
}

StoredAnnotation AnchorManager::Stored(const AnchorRecord& record) {
  StoredAnnotation stored{record.annotation, record.place.world_key};
  if (record.end) {
    stored.end_covariance_in_world = record.end->anchor.covariance_in_world;
    // Another map's world says nothing of this one's: both ends, or none.
    if (record.end->place.world_key != stored.world_key) stored.world_key.clear();
  }
  return stored;
}

/// One step, which the history no longer holds where somebody else changed the annotation since.
absl::StatusOr<AnnotationEdit> AnchorManager::TakeBackStep(bool undo, const EditStepPtr& step,
                                                           const Editor& editor) {
  EditHistory history = histories_.Get(editor.person_id);
  std::vector<EditStepPtr>& from = undo ? history.done : history.undone;
  std::vector<EditStepPtr>& to = undo ? history.undone : history.done;
  std::erase(from, step);
  const AnchorRecord* live = Find(step->id);
  if (!IsUnchanged(live, undo ? step->after : step->before)) {
    histories_.Set(editor.person_id, std::move(history));
    return absl::FailedPreconditionError(
        absl::StrCat("somebody else changed it since you ", step->description,
                     "; that step is skipped, the one before it is next"));
  }
  if (live) {
    if (absl::Status may = CheckMayChange(live->annotation, editor); !may.ok()) return may;
  }
  const PastStatePtr& wanted = undo ? step->before : step->after;
  std::optional<AnchorRecord> restored;
  if (wanted) {
    const bool own = wanted->annotation.author_person_id == editor.person_id;
    absl::Status fits = CheckGrowth(live, wanted->annotation, own ? editor.person_id : "");
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
  return Commit(undo ? EditKind::kUndo : EditKind::kRedo, editor, step->id,
                restored ? &*restored : nullptr, std::move(history),
                absl::StrCat(undo ? "took back: " : "did again: ", step->description));
}

absl::StatusOr<AnnotationEdit> AnchorManager::TakeBack(bool undo, const Editor& editor) {
  const EditHistory history = histories_.Get(editor.person_id);
  const std::vector<EditStepPtr>& from = undo ? history.done : history.undone;
  if (from.empty()) {
    return absl::FailedPreconditionError(undo ? "you have nothing to undo"
                                              : "you have nothing to redo");
  }
  const std::vector<EditStepPtr> steps = NewestGroup(from);
  const std::uint64_t before = next_sequence_ - 1;
  std::vector<AnnotationEdit> edits;
  std::vector<std::string> kept;
  absl::Status skipped;
  for (const EditStepPtr& step : steps) {
    absl::StatusOr<AnnotationEdit> edit = TakeBackStep(undo, step, editor);
    if (edit.ok()) {
      edits.push_back(*std::move(edit));
    } else if (absl::IsFailedPrecondition(edit.status())) {
      skipped = edit.status();
      kept.push_back(NameOf(*step));
    } else {  // all or nothing
      RollBack(before);
      return edit.status();
    }
  }
  if (edits.empty()) return skipped;
  AnnotationEdit all = std::move(edits.back());
  edits.pop_back();
  for (AnnotationEdit& edit : edits) all.with.push_back(std::move(edit.change));
  if (steps.size() > 1) {
    all.description = absl::StrCat(undo ? "took back " : "did again ", all.with.size() + 1, " of ",
                                   steps.size(), " changes made together", SayKept(kept));
  }
  return all;
}

/// `past` as a live record, in place of `live` (null: it does not exist any more).
AnchorRecord AnchorManager::Restore(const PastState& past, const AnchorRecord* live) const {
  AnchorRecord record = live ? *live : AnchorRecord{};
  const Annotation now = record.annotation;
  record.annotation = past.annotation;
  record.content_id = past.content_id;
  if (live) record.annotation.revision = now.revision;
  record.annotation.revision += 1;
  const bool stays =
      live && (!past.place || (live->place.id == past.place->id &&
                               EndId(live->end ? &*live->end : nullptr) == EndId(past.end.get())));
  if (stays) {  // the place was not part of the edit
    record.annotation.anchor = now.anchor;
    if (record.end) {
      record.annotation.ink_offset_m = now.ink_offset_m;
      record.annotation.length_m = now.length_m;
      record.annotation.length_sigma_m = now.length_sigma_m;
    }
  } else if (past.place) {
    record.place = *past.place;
    record.end.reset();
    if (past.end) record.end = *past.end;
    if (record.end) record.end->told_ns = 0;
  }
  int selections_left = 2;
  if (newest_) Estimate(record, selections_left);
  return record;
}

absl::StatusOr<AnnotationEdit> AnchorManager::Undo(const Editor& editor) {
  return TakeBack(true, editor);
}

absl::StatusOr<AnnotationEdit> AnchorManager::Redo(const Editor& editor) {
  return TakeBack(false, editor);
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

void AnchorManager::ForgetPerson(const std::string& person_id) { histories_.Forget(person_id); }

void AnchorManager::Committed(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.front().sequence <= sequence) pending_.pop_front();
}

void AnchorManager::RollBack(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.back().sequence > sequence) {
    PendingEdit& edit = pending_.back();
    Put(edit.id, edit.before.get());
    histories_.Set(edit.person_id, std::move(edit.history_before));
    pending_.pop_back();
  }
  Publish();
}

}  // namespace saccade
