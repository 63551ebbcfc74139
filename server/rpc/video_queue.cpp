#include "server/rpc/video_queue.hpp"

#include <algorithm>
#include <utility>

namespace saccade {

void VideoQueue::NoteSequence(const VideoPacket& packet) {
  const bool gap = packet.sequence != last_sequence_ + 1;
  last_sequence_ = packet.sequence;
  if (gap && !packet.key_frame) LoseReference();
}

void VideoQueue::Skip(const VideoPacket& packet) {
  NoteSequence(packet);
  if (started_) ++skipped_;
  if (packet.temporal_layer == 0) {
    LoseReference();
  } else if (packet.temporal_layer == 1) {
    reference_kept_ = false;
  }
}

void VideoQueue::Push(std::shared_ptr<const VideoPacket> packet) {
  NoteSequence(*packet);
  if (!Fits(*packet)) {
    if (started_) ++skipped_;
    return;
  }
  waiting_.push_back(std::move(packet));
  Shed();
}

// Decides whether everything that the packet refers to is there, and remembers it as a reference.
bool VideoQueue::Fits(const VideoPacket& packet) {
  if (packet.key_frame) {
    needs_key_frame_ = false;
    asked_ns_ = 0;
    reference_kept_ = true;
    return true;
  }
  if (needs_key_frame_) return false;
  // Layer 0 refers to layer 0, layer 1 to layer 0, layer 2 to the newest picture below it.
  if (packet.temporal_layer < 2) {
    reference_kept_ = true;
    return true;
  }
  return reference_kept_;
}

void VideoQueue::Shed() {
  if (waiting_.size() <= limits_.shed_layer_2) return;
  // A key frame needs nothing before it.
  const auto newest_key = std::find_if(waiting_.rbegin(), waiting_.rend(),
                                       [](const auto& packet) { return packet->key_frame; });
  if (newest_key != waiting_.rend()) {
    const auto first_kept = newest_key.base() - 1;
    skipped_ += static_cast<std::uint64_t>(first_kept - waiting_.begin());
    waiting_.erase(waiting_.begin(), first_kept);
  }
  if (waiting_.size() > limits_.shed_layer_2) RemoveLayer(2);
  if (waiting_.size() > limits_.shed_layer_1) RemoveLayer(1);
  if (waiting_.size() > limits_.shed_all) DropAll();
}

// Layer 2 is gone when layer 1 goes, so nothing left refers to what is removed; but a layer 2 that
// is still to come may.
void VideoQueue::RemoveLayer(int temporal_layer) {
  if (waiting_.back()->temporal_layer == temporal_layer && temporal_layer == 1) {
    reference_kept_ = false;
  }
  skipped_ += std::erase_if(waiting_, [temporal_layer](const auto& packet) {
    return packet->temporal_layer == temporal_layer;
  });
}

void VideoQueue::DropAll() {
  skipped_ += waiting_.size();
  waiting_.clear();
  needs_key_frame_ = true;
}

std::shared_ptr<const VideoPacket> VideoQueue::Take(Timestamp now_ns) {
  if (waiting_.empty()) return nullptr;
  if (now_ns - waiting_.front()->tracked.stages.encoded_ns > limits_.max_age_ns) {
    DropAll();
    return nullptr;
  }
  std::shared_ptr<const VideoPacket> packet = std::move(waiting_.front());
  waiting_.pop_front();
  started_ = true;
  return packet;
}

// Once a key frame is wanted, further losses are no reason to ask again sooner.
void VideoQueue::LoseReference() {
  if (!needs_key_frame_) RequireKeyFrame();
}

void VideoQueue::RequireKeyFrame() {
  if (!needs_key_frame_) DropAll();
  asked_ns_ = 0;
}

bool VideoQueue::WantsKeyFrame(Timestamp now_ns) {
  if (!needs_key_frame_ || (asked_ns_ != 0 && now_ns - asked_ns_ < limits_.ask_again_ns)) {
    return false;
  }
  asked_ns_ = now_ns;
  return true;
}

}  // namespace saccade
