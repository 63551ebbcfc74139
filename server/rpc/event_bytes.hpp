#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "saccade/v1/session.pb.h"
#include "server/pipeline/events.hpp"
#include "server/rpc/change_log.hpp"
#include "server/rpc/deltas.hpp"

namespace saccade {

using Bytes = std::shared_ptr<const std::string>;

/// An event on its way out, encoded: `head`, `shared` and `tail`, one after the other. `shared` is
/// held by all the streams that send the same.
struct EncodedEvent {
  std::string head;
  Bytes shared;  // null: none
  std::string tail;

  /// `payload`, an encoded message, as field `field` of an Event.
  static EncodedEvent Of(std::uint64_t sequence, int field, Bytes payload, std::string tail = "");
  /// For tests and what nobody shares.
  std::string Joined() const { return head + (shared ? *shared : "") + tail; }
};

/// Encodes what many subscribers get alike, once. Remembers the last few of each kind. Thread safe;
/// who asks for what another is encoding waits for it.
class EventBytes {
 public:
  /// v1::AccessUnit without queued_ns; `features`: what its frame saw of the map.
  Bytes AccessUnit(const std::shared_ptr<const VideoPacket>& packet, bool features);
  /// v1::PoseEvent.
  Bytes Pose(const TrackedEvent& tracked);
  /// v1::MapDelta, v1::AnnotationEvent: the next part of what `reader` lacks; null: nothing worth
  /// sending. Readers that had the same state share the way to the next.
  Bytes Map(const NumberedState& state, MapReader& reader);
  Bytes Annotations(const NumberedState& state, AnnotationReader& reader);
  /// v1::PresenceEvent, v1::GazeState.
  Bytes Presence(const std::shared_ptr<const v1::PresenceEvent>& presence);
  Bytes Gaze(const std::shared_ptr<const GazeSnapshot>& state);

 private:
  // The last results by what they were made of. Its key is held too: an address is not used again.
  class Memory {
   public:
    using Key = std::pair<std::shared_ptr<const void>, std::uint64_t>;
    Bytes Get(const Key& key, const std::function<Bytes()>& make);

   private:
    std::mutex mutex_;
    std::vector<std::pair<Key, Bytes>> kept_;  // oldest first
  };
  // What a reader was sent on the way from one complete state to another, and the reader after it.
  template <typename Reader>
  class Ways {
   public:
    template <typename Message>
    Bytes Next(const std::shared_ptr<const void>& to, const NumberedState& state, Reader& reader);

   private:
    struct Way {
      std::shared_ptr<const void> to;
      Reader before, after;
      Bytes bytes;
    };
    std::mutex mutex_;
    std::vector<Way> kept_;  // oldest first
  };

  static constexpr std::size_t kKept = 8;
  Memory units_, poses_, presence_, gaze_;
  Ways<MapReader> map_;
  Ways<AnnotationReader> annotations_;
};

}  // namespace saccade
