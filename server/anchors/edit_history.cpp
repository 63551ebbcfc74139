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
                      state->owner.capacity();
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
               BytesOf(step->before, seen) + BytesOf(step->after, seen);
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
  state->owner = record->owner;
  if (with_place) state->place = std::make_shared<const AnchorPlace>(record->place);
  return state;
}

PastStatePtr LastLeft(const EditHistory& history, const AnchorRecord* record) {
  if (history.done.empty() || !record) return nullptr;
  const EditStep& last = *history.done.back();
  return last.id == record->annotation.id && IsUnchanged(record, last.after) ? last.after : nullptr;
}

EditHistory EditHistories::Get(const std::string& session_id) const {
  const auto found = held_.find(session_id);
  return found == held_.end() ? EditHistory{} : found->second.history;
}

void EditHistories::Set(const std::string& session_id, EditHistory history) {
  Forget(session_id);
  while (history.done.size() > limits_.steps) history.done.erase(history.done.begin());
  std::size_t bytes = BytesOf(history);
  while (!IsEmpty(history) && bytes > limits_.bytes_per_session) {
    DropOldest(history);
    bytes = BytesOf(history);
  }
  if (IsEmpty(history)) return;
  bytes_ += bytes;
  held_[session_id] = {std::move(history), bytes};
  while (bytes_ > limits_.bytes && !held_.empty()) DropOldestStep();
}

void EditHistories::Forget(const std::string& session_id) {
  const auto found = held_.find(session_id);
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
