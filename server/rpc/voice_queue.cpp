#include "server/rpc/voice_queue.hpp"

#include <algorithm>
#include <utility>

namespace saccade {

void VoiceQueue::Push(const VoiceBatch& batch) {
  if (batch.packets.empty()) return;
  auto speaker = std::find_if(waiting_.begin(), waiting_.end(), [&](const Speaker& one) {
    return one.participant_id == batch.participant_id;
  });
  if (speaker == waiting_.end()) {
    if (waiting_.size() >= kMaxSpeakers) {
      skipped_ += batch.packets.size();
      return;
    }
    speaker = waiting_.insert(waiting_.end(), {batch.participant_id, {}});
  }
  std::deque<std::shared_ptr<const v1::VoicePacket>>& packets = speaker->packets;
  packets.insert(packets.end(), batch.packets.begin(), batch.packets.end());
  while (packets.size() > kMaxPackets) {
    packets.pop_front();
    ++skipped_;
  }
}

bool VoiceQueue::Take(v1::VoiceEvent& event) {
  if (waiting_.empty()) return false;
  const Speaker speaker = std::move(waiting_.front());
  waiting_.pop_front();
  event.set_participant_id(speaker.participant_id);
  for (const auto& packet : speaker.packets) *event.add_packets() = *packet;
  return true;
}

}  // namespace saccade
