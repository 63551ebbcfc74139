#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "server/pipeline/events.hpp"

namespace saccade {

/// What one subscriber has yet to be sent of one view. Bounded: a slow subscriber sheds temporal
/// layer 2, then 1, then everything until a key frame; never an arbitrary delta, so whatever Take
/// returns is decodable after what it returned before. Not thread safe.
class VideoQueue {
 public:
  struct Limits {
    std::size_t shed_layer_2 = 2;          // packets waiting before layer 2 goes
    std::size_t shed_layer_1 = 3;          // ... layer 1
    std::size_t shed_all = 4;              // ... and all
    Timestamp max_age_ns = 500'000'000;    // older than this is not worth sending
    Timestamp ask_again_ns = 500'000'000;  // between two requests for a key frame
  };

  VideoQueue() = default;
  explicit VideoQueue(const Limits& limits) : limits_(limits) {}

  void Push(std::shared_ptr<const VideoPacket> packet);
  /// In its place: a packet that nobody is sent, because the server is behind as a whole.
  void Skip(const VideoPacket& packet);

  /// The next packet to send, or null. Call only when it can be sent at once.
  std::shared_ptr<const VideoPacket> Take(Timestamp now_ns);

  /// The decoder lost its state: nothing more until a key frame.
  void RequireKeyFrame();

  /// True if a key frame has to be asked for now; so answered once per `ask_again_ns`.
  bool WantsKeyFrame(Timestamp now_ns);

  /// Packets not sent although a faster subscriber would have had them.
  std::uint64_t skipped() const { return skipped_; }

 private:
  void NoteSequence(const VideoPacket& packet);
  bool Fits(const VideoPacket& packet);
  void Shed();
  void RemoveLayer(int temporal_layer);
  void DropAll();
  void LoseReference();

  Limits limits_;
  std::deque<std::shared_ptr<const VideoPacket>> waiting_;
  bool needs_key_frame_ = true;
  bool started_ = false;         // a key frame was taken once: what is missed now counts as skipped
  bool reference_kept_ = false;  // the newest packet below layer 2 is queued or sent
  std::uint64_t last_sequence_ = 0;
  std::uint64_t skipped_ = 0;
  Timestamp asked_ns_ = 0;
};

}  // namespace saccade
