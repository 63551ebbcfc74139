#pragma once

#include <memory>

#include "server/pipeline/events.hpp"
#include "server/rpc/subscription.hpp"

namespace saccade::testing {

/// What is known after frame `id`: a map with one feature, no annotations.
inline TrackedEvent MakeTracked(FrameId id, Timestamp captured_ns = 0) {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = id;
  snapshot->features.resize(1);
  snapshot->features[0].id = 5;
  CameraIntrinsics intrinsics{
      .width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  TrackedEvent event;
  event.snapshot = snapshot;
  event.annotations = std::make_shared<AnnotationList>();
  event.camera = std::make_shared<CameraModel>(intrinsics);
  event.stages.captured_ns = captured_ns;
  return event;
}

/// Packet `index` of an endless stream with OpenH264's pattern 0 2 1 2; key frames where asked.
inline std::shared_ptr<const VideoPacket> MakePacket(std::uint64_t index, bool key_frame = false,
                                                     Timestamp encoded_ns = 0) {
  constexpr int kPattern[4] = {0, 2, 1, 2};
  auto packet = std::make_shared<VideoPacket>();
  packet->sequence = index + 1;
  packet->key_frame = key_frame;
  packet->temporal_layer = key_frame ? 0 : kPattern[index % 4];
  packet->data = std::make_shared<const std::string>("data");
  packet->tracked = MakeTracked(index);
  packet->tracked.stages.encoded_ns = encoded_ns;
  return packet;
}

/// A subscription that is fed as by the hub: what is tracked is numbered first.
class FedSubscription : public Subscription {
 public:
  using Subscription::Next;
  using Subscription::Offer;
  using Subscription::Subscription;
  void Offer(const TrackedEvent& event, Timestamp now_ns = 0) { Offer(log_.Next(event, now_ns)); }
  /// The next event as a client reads it.
  bool Next(Timestamp now_ns, v1::Event& event) {
    EncodedEvent encoded;
    return Next(now_ns, encoded) && event.ParseFromString(encoded.Joined());
  }

 private:
  ChangeLog log_;
};

}  // namespace saccade::testing
