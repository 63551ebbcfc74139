#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "server/anchors/anchor_record.hpp"

namespace saccade {

/// A state of an annotation that undo or redo can bring back. Its stroke is the live one's own, and
/// its place in the map is kept only if the edit was about it (created, deleted, moved).
struct PastState {
  Annotation annotation;
  std::uint64_t content_id = 0;
  std::shared_ptr<const AnchorPlace> place;  // null: stays where it is
  std::shared_ptr<const MeasureEnd> end;     // beside `place`, of a measure
};
using PastStatePtr = std::shared_ptr<const PastState>;

/// One edit by one person: null before: created, null after: deleted.
struct EditStep {
  std::string id;
  PastStatePtr before;
  PastStatePtr after;
  std::string description;     // in words, of doing it
  bool touches_place = false;  // created, deleted or moved: the states hold their places
  std::uint64_t number = 0;    // rises over all persons: which step is older
  std::string group;           // steps with the same one, not empty, are taken back together
};
using EditStepPtr = std::shared_ptr<const EditStep>;

/// What one person did and took back, oldest first. Copying it copies pointers.
struct EditHistory {
  std::vector<EditStepPtr> done;
  std::vector<EditStepPtr> undone;
};

/// `record` as undo keeps it; null stays null.
PastStatePtr Past(const AnchorRecord* record, bool with_place);
/// Whether `live` is still what `expected` left (both null: it does not exist).
bool IsUnchanged(const AnchorRecord* live, const PastStatePtr& expected);
/// The state that the person's own last step left, if `record` still is that: not to be kept
/// twice. Null otherwise.
PastStatePtr LastLeft(const EditHistory& history, const AnchorRecord* record);

/// Adds `step`, the newest. Where one of its group is about the same annotation, as that step left
/// it, both become one: what is dragged for seconds is one step. `before`, `after`: the records.
void AddStep(std::shared_ptr<EditStep> step, const AnchorRecord* before, const AnchorRecord* after,
             EditHistory& history);

/// The steps to take back, or do again, together: the newest of `from`, and those of its group.
/// Newest first.
std::vector<EditStepPtr> NewestGroup(const std::vector<EditStepPtr>& from);

/// Memory that a history holds: each state, place and stroke once, strokes and
/// pictures as if nobody else had them. O(steps).
std::size_t BytesOf(const EditHistory& history);

/// The histories of all persons, bounded in steps and bytes: what is oldest can no longer be
/// undone.
class EditHistories {
 public:
  struct Limits {
    std::size_t steps = 0;  // per person
    std::size_t bytes_per_person = 0;
    std::size_t bytes = 0;  // over all persons
  };
  explicit EditHistories(const Limits& limits) : limits_(limits) {}

  /// Empty for a person who has done nothing.
  EditHistory Get(const std::string& person_id) const;
  void Set(const std::string& person_id, EditHistory history);
  void Forget(const std::string& person_id);

  std::size_t bytes() const { return bytes_; }
  std::size_t persons() const { return held_.size(); }

 private:
  struct Held {
    EditHistory history;
    std::size_t bytes = 0;
  };
  void DropOldestStep();

  const Limits limits_;
  absl::flat_hash_map<std::string, Held> held_;  // by person
  std::size_t bytes_ = 0;
};

/// A change that is not on disk yet, with what it takes to revoke it.
struct PendingEdit {
  std::uint64_t sequence = 0;
  std::string id;
  RecordPtr before;  // null: did not exist
  std::string person_id;
  EditHistory history_before;
};

}  // namespace saccade
