#include "server/anchors/edit_history.hpp"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <utility>

namespace saccade {
namespace {

using Seen = absl::flat_hash_set<const void*>;

std::size_t BytesOf(const AnchorPlace& place) {
  return sizeof(place) + place.world_key.capacity() +
         place.members.capacity() * sizeof(ClusterMember);
}

std::size_t BytesOf(const PastStatePtr& state, Seen& seen) {
  if (state == nullptr || !seen.insert(state.get()).second) return 0;
  const Annotation& annotation = state->annotation;
  std::size_t bytes = sizeof(*state) + annotation.id.capacity() + annotation.text.capacity() +
                      annotation.author.capacity() + annotation.anchor.reason.capacity() +
                      annotation.author_person_id.capacity() + annotation.locked_by.capacity();
  if (state->end && seen.insert(state->end.get()).second) {
    bytes += sizeof(MeasureEnd) + BytesOf(state->end->place);
  }
  if (annotation.picture && seen.insert(annotation.picture.get()).second) {
    bytes += sizeof(Picture) + annotation.picture->bytes.capacity();
  }
  if (annotation.check_items && seen.insert(annotation.check_items.get()).second) {
    for (const CheckItem& item : *annotation.check_items) {
      bytes += sizeof(item) + item.text.capacity() + item.done_by.capacity();
    }
  }
  if (state->place && seen.insert(state->place.get()).second) bytes += BytesOf(*state->place);
  const InkStroke& ink = annotation.ink_offset_m;
  if (!ink.empty() && seen.insert(ink.identity()).second) bytes += ink.bytes();
  return bytes;
}

/// The step that could be taken back, or done again, last of all.
void DropOldest(EditHistory& history) {
  std::vector<EditStepPtr>& from = history.done.empty() ? history.undone : history.done;
  from.erase(from.begin());
}

bool IsEmpty(const EditHistory& history) { return history.done.empty() && history.undone.empty(); }

std::uint64_t OldestNumber(const EditHistory& history) {
  return (history.done.empty() ? history.undone : history.done).front()->number;
}

}  // namespace

std::size_t BytesOf(const EditHistory& history) {
  Seen seen;
  std::size_t bytes = 0;
  for (const auto* steps : {&history.done, &history.undone}) {
    for (const EditStepPtr& step : *steps) {
      bytes += sizeof(EditStep) + step->id.capacity() + step->description.capacity() +
               step->group.capacity() + BytesOf(step->before, seen) + BytesOf(step->after, seen);
    }
  }
  return bytes;
}

bool IsUnchanged(const AnchorRecord* live, const PastStatePtr& expected) {
  if (!live || !expected) return !live && !expected;
  return live->content_id == expected->content_id;
}

PastStatePtr Past(const AnchorRecord* record, bool with_place) {
  if (!record) return nullptr;
  auto state = std::make_shared<PastState>();
  state->annotation = record->annotation;
  state->content_id = record->content_id;
  if (with_place) {
    state->place = std::make_shared<const AnchorPlace>(record->place);
    if (record->end) state->end = std::make_shared<const MeasureEnd>(*record->end);
  }
  return state;
}

PastStatePtr LastLeft(const EditHistory& history, const AnchorRecord* record) {
  if (history.done.empty() || !record) return nullptr;
  const EditStep& last = *history.done.back();
  return last.id == record->annotation.id && IsUnchanged(record, last.after) ? last.after : nullptr;
}

void AddStep(std::shared_ptr<EditStep> step, const AnchorRecord* before, const AnchorRecord* after,
             EditHistory& history) {
  const auto continues = [&](const EditStepPtr& older) {
    return !step->group.empty() && older->group == step->group && older->id == step->id &&
           IsUnchanged(before, older->after);
  };
  history.undone.clear();
  const auto older = std::find_if(history.done.begin(), history.done.end(), continues);
  if (older == history.done.end()) {
    history.done.push_back(std::move(step));
    return;
  }
  const EditStep& first = **older;
  if (first.touches_place != step->touches_place) {
    step->touches_place = true;
    step->after = Past(after, true);
  }
  const PastStatePtr place_before = Past(before, true);
  step->before = first.before;
  if (step->touches_place && first.before && !first.before->place) {
    auto with_place = std::make_shared<PastState>(*first.before);
    with_place->place = place_before->place;  // the older step left it where it was
    with_place->end = place_before->end;
    step->before = std::move(with_place);
  }
  if (!step->before) step->description = first.description;  // it is still new
  step->number = first.number;
  history.done.erase(older);
  if (step->before || step->after) history.done.push_back(std::move(step));
}

std::vector<EditStepPtr> NewestGroup(const std::vector<EditStepPtr>& from) {
  std::vector<EditStepPtr> steps = {from.back()};
  if (steps[0]->group.empty()) return steps;
  for (std::size_t i = from.size() - 1; i-- > 0;) {
    if (from[i]->group == steps[0]->group) steps.push_back(from[i]);
  }
  return steps;
}

EditHistory EditHistories::Get(const std::string& person_id) const {
  const auto found = held_.find(person_id);
  return found == held_.end() ? EditHistory{} : found->second.history;
}

void EditHistories::Set(const std::string& person_id, EditHistory history) {
  Forget(person_id);
  while (history.done.size() > limits_.steps) history.done.erase(history.done.begin());
  std::size_t bytes = BytesOf(history);
  while (!IsEmpty(history) && bytes > limits_.bytes_per_person) {
    DropOldest(history);
    bytes = BytesOf(history);
  }
  if (IsEmpty(history)) return;
  bytes_ += bytes;
  held_[person_id] = {std::move(history), bytes};
  while (bytes_ > limits_.bytes && !held_.empty()) DropOldestStep();
}

void EditHistories::Forget(const std::string& person_id) {
  const auto found = held_.find(person_id);
  if (found == held_.end()) return;
  bytes_ -= found->second.bytes;
  held_.erase(found);
}

void EditHistories::DropOldestStep() {
  const auto oldest =
      std::min_element(held_.begin(), held_.end(), [](const auto& a, const auto& b) {
        return OldestNumber(a.second.history) < OldestNumber(b.second.history);
      });
  Held& held = oldest->second;
  bytes_ -= held.bytes;
  DropOldest(held.history);
  held.bytes = BytesOf(held.history);
  bytes_ += held.bytes;
  if (IsEmpty(held.history)) held_.erase(oldest);
}

}  // namespace saccade
