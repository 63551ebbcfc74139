#include "server/rpc/deltas.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

// Upper bounds of what one thing adds to an event [bytes]; held against the encoder by a test.
constexpr std::size_t kFeatureBytes = 160;
constexpr std::size_t kFeatureRemovalBytes = 10;
constexpr std::size_t kIdBytes = 40;
constexpr std::size_t kAnchorBytes = 160;
constexpr std::size_t kAnnotationBytes = 127;
constexpr std::size_t kTurnBytes = 41, kExtentBytes = 31, kNumberBytes = 7, kLengthsBytes = 20;
constexpr std::size_t kPictureBytes = 30;  // but for its texts
constexpr std::size_t kItemBytes = 26;
constexpr std::size_t kInkPointBytes = 29;
constexpr std::size_t kLengthBytes = 6;

enum class Lack { kWhole, kEstimate, kRemoval };

// What a reader lacks, one kind after the other, until a part is full.
template <typename Id, typename Size, typename Put>
class PartFiller {
 public:
  // `size` and `put` take an index, into the list or the removals, and a Lack.
  PartFiller(const Changes<Id>& changes, ReadPosition& at, Size size, Put put)
      : changes_(changes), at_(at), size_(std::move(size)), put_(std::move(put)) {}

  void Fill() {
    if (at_.IsUpTo(changes_.newest)) return;
    const ChangeNumber had = at_.content;
    if (FillWhole() && FillEstimates(had)) FillRemovals();
  }

 private:
  // All for which `lacks` holds, by the number of their content. `from`: what changed up to there
  // is of no interest.
  template <typename Lacks>
  std::vector<std::uint32_t> Items(ChangeNumber from, Lacks lacks) const {
    std::vector<std::uint32_t> items;
    const auto add = [&](std::uint32_t i) {
      if (lacks(i)) items.push_back(i);
    };
    if (from >= changes_.previous) {
      for (const std::uint32_t i : changes_.changed) add(i);
    } else {
      for (std::uint32_t i = 0; i < changes_.numbers.size(); ++i) add(i);
    }
    std::sort(items.begin(), items.end(), [this](std::uint32_t a, std::uint32_t b) {
      return changes_.content_numbers[a] < changes_.content_numbers[b];
    });
    return items;
  }

  bool Add(std::uint32_t index, Lack lack) {
    bytes_ += size_(index, lack);
    if (bytes_ > kPartBytes && any_) return false;
    put_(index, lack);
    return any_ = true;
  }

  bool FillWhole() {
    const auto lacks = [this](std::uint32_t i) {
      return changes_.content_numbers[i] > at_.content;
    };
    for (const std::uint32_t i : Items(at_.content, lacks)) {
      if (!Add(i, Lack::kWhole)) return false;
      at_.content = changes_.content_numbers[i];
    }
    at_.content = changes_.newest;
    return true;
  }

  // Not of what went out whole just now: of those up to content `had`.
  bool FillEstimates(ChangeNumber had) {
    if (at_.round_at == 0) at_.round_until = changes_.newest;
    const auto lacks = [this, had](std::uint32_t i) {
      return changes_.numbers[i] > at_.estimate && changes_.content_numbers[i] <= had &&
             changes_.content_numbers[i] > at_.round_at;
    };
    for (const std::uint32_t i : Items(at_.estimate, lacks)) {
      if (!Add(i, Lack::kEstimate)) return false;
      at_.round_at = changes_.content_numbers[i];
    }
    at_.estimate = at_.round_until;
    at_.round_at = 0;
    return true;
  }

  void FillRemovals() {
    const auto& removed = *changes_.removed;
    auto at = std::upper_bound(
        removed.begin(), removed.end(), at_.removal,
        [](ChangeNumber number, const auto& removal) { return number < removal.number; });
    for (; at != removed.end(); ++at) {
      if (!Add(static_cast<std::uint32_t>(at - removed.begin()), Lack::kRemoval)) return;
      at_.removal = at->number;
    }
    at_.removal = changes_.newest;
  }

  const Changes<Id>& changes_;
  ReadPosition& at_;
  const Size size_;
  const Put put_;
  std::size_t bytes_ = kLengthBytes + kIdBytes;
  bool any_ = false;
};

// The reader knows nothing: what was removed so far is nothing to it, estimates come with the
// whole.
template <typename Id>
ReadPosition Beginning(const Changes<Id>& changes) {
  ReadPosition at;
  at.started = true;
  at.estimate = at.removal = changes.newest;
  return at;
}

std::size_t AnchorBytes(const Anchor& anchor) {
  return kAnchorBytes + anchor.reason.size() + kLengthBytes;
}

}  // namespace

std::size_t EncodedBytes(const Annotation& annotation) {
  std::size_t bytes = kAnnotationBytes + annotation.id.size() + annotation.text.size() +
                      annotation.author.size() + annotation.author_person_id.size() +
                      AnchorBytes(annotation.anchor) +
                      kInkPointBytes * annotation.ink_offset_m.size();
  if (annotation.picture) {
    bytes +=
        kPictureBytes + annotation.picture->sha256.size() + annotation.picture->media_type.size();
  }
  if (annotation.check_items) {
    for (const CheckItem& item : *annotation.check_items) {
      bytes += kItemBytes + item.text.size() + item.done_by.size();
    }
  }
  return bytes;
}

bool MapReader::Next(const NumberedState& state, v1::MapDelta& delta) {
  const MapSnapshot& snapshot = *state.tracked.snapshot;
  const Changes<FeatureId>& changes = *state.map;
  const bool full =
      !at_.started || snapshot.map_generation != generation_ || at_.removal < changes.forgotten;
  if (full) at_ = Beginning(changes);
  const bool jumped = snapshot.map_revision != revision_;
  generation_ = snapshot.map_generation;
  revision_ = snapshot.map_revision;
  delta.Clear();
  delta.set_map_generation(snapshot.map_generation);
  delta.set_map_revision(snapshot.map_revision);
  delta.set_frame_id(snapshot.frame_id);
  delta.set_full(full);
  const auto size = [](std::uint32_t, Lack lack) {
    return lack == Lack::kRemoval ? kFeatureRemovalBytes : kFeatureBytes;
  };
  const auto put = [&](std::uint32_t index, Lack lack) {
    if (lack == Lack::kRemoval) {
      delta.add_removed_ids((*changes.removed)[index].id);
    } else {
      *delta.add_upserted() = wire::ToProto(snapshot.features[index]);
    }
  };
  PartFiller(changes, at_, size, put).Fill();
  delta.set_more(!at_.IsUpTo(changes.newest));
  return full || jumped || delta.upserted_size() > 0 || delta.removed_ids_size() > 0;
}

bool AnnotationReader::Next(const NumberedState& state, v1::AnnotationEvent& delta) {
  const AnnotationList& annotations = *state.tracked.annotations;
  const Changes<std::string>& changes = *state.annotations;
  const bool full = !at_.started || at_.removal < changes.forgotten;
  if (full) at_ = Beginning(changes);
  delta.Clear();
  delta.set_full(full);
  const auto without_stroke = [&](std::uint32_t index, Lack lack) {
    return lack == Lack::kEstimate && !annotations[index].ink_offset_m.empty();
  };
  const auto size = [&](std::uint32_t index, Lack lack) {
    if (lack == Lack::kRemoval) return kIdBytes;
    return without_stroke(index, lack) ? kIdBytes + AnchorBytes(annotations[index].anchor)
                                       : EncodedBytes(annotations[index]);
  };
  const auto put = [&](std::uint32_t index, Lack lack) {
    if (lack == Lack::kRemoval) {
      delta.add_removed_ids((*changes.removed)[index].id);
    } else if (without_stroke(index, lack)) {
      v1::AnchorUpdate& update = *delta.add_anchors();
      update.set_id(annotations[index].id);
      *update.mutable_anchor() = wire::ToProto(annotations[index].anchor);
    } else {
      *delta.add_upserted() = wire::ToProto(annotations[index]);
    }
  };
  PartFiller(changes, at_, size, put).Fill();
  delta.set_more(!at_.IsUpTo(changes.newest));
  return full || delta.upserted_size() > 0 || delta.anchors_size() > 0 ||
         delta.removed_ids_size() > 0;
}

v1::MapDelta FullMap(const MapSnapshot& snapshot) {
  v1::MapDelta delta;
  delta.set_map_generation(snapshot.map_generation);
  delta.set_map_revision(snapshot.map_revision);
  delta.set_frame_id(snapshot.frame_id);
  delta.set_full(true);
  for (const FeatureSnapshot& feature : snapshot.features) {
    *delta.add_upserted() = wire::ToProto(feature);
  }
  return delta;
}

}  // namespace saccade
