#include "server/rpc/packet_backlog.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace saccade {

void PacketBacklog::Push(std::shared_ptr<const VideoPacket> packet) {
  if (packet->key_frame) {  // needs nothing before it
    for (Entry& entry : entries_) entry.shed = true;
  }
  entries_.push_back({std::move(packet), false});
  if (Waiting() > kShedLayer2) ShedLayer(2);
  if (Waiting() > kShedLayer1) ShedLayer(1);
  if (entries_.size() > kKept) entries_.pop_front();  // a gap: costs a key frame
}

std::size_t PacketBacklog::Waiting() const {
  return static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(),
                                                [](const Entry& entry) { return !entry.shed; }));
}

void PacketBacklog::ShedLayer(int temporal_layer) {
  for (Entry& entry : entries_) {
    if (entry.packet->temporal_layer == temporal_layer) entry.shed = true;
  }
}

std::vector<PacketBacklog::Entry> PacketBacklog::TakeAll() {
  std::vector<Entry> all(std::make_move_iterator(entries_.begin()),
                         std::make_move_iterator(entries_.end()));
  entries_.clear();
  return all;
}

}  // namespace saccade
