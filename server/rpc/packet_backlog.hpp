#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "server/pipeline/events.hpp"

namespace saccade {

/// Pictures of one view that wait for the hub to come round. While it is behind, all subscribers
/// lose the same: temporal layer 2 first, then layer 1, then what is older than a key frame. Not
/// thread safe.
class PacketBacklog {
 public:
  struct Entry {
    std::shared_ptr<const VideoPacket> packet;
    bool shed = false;  // left out for everybody; its place in the sequence is told all the same
  };

  void Push(std::shared_ptr<const VideoPacket> packet);
  std::vector<Entry> TakeAll();

 private:
  static constexpr std::size_t kShedLayer2 = 2;  // pictures waiting before layer 2 goes
  static constexpr std::size_t kShedLayer1 = 3;  // ... layer 1
  static constexpr std::size_t kKept = 64;       // entries; a hub that stands still for 2 s

  std::size_t Waiting() const;
  void ShedLayer(int temporal_layer);

  std::deque<Entry> entries_;
};

}  // namespace saccade
