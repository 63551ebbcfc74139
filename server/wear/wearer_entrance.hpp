#pragma once

#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "server/capture/phone/phone_source.hpp"
#include "server/identity/access_book.hpp"
#include "server/pipeline/events.hpp"
#include "server/pipeline/wearer_port.hpp"

namespace saccade {

/// Who may be the camera, over the WebSocket /wear/upstream (proto/saccade/v1/wearer.proto).
///
/// A link begins with a hello that carries a token of the role wearer, which is looked at again
/// ten times a second as long as the link lasts. Links without one are few and short: nobody who
/// is not let in holds the gateway's connections. One phone at a time has the camera: another one
/// is refused in words; the same one, by its pass and its own id, takes over from its own dead
/// link. Whatever is malformed ends the link. Thread safe.
class WearerEntrance final : public WearerPort {
 public:
  static constexpr char kWhat[] = "GET /wear/upstream";  // in the table of roles

  /// `source` null: this server has another camera, which is `other`; phones are told so. All
  /// outlive the entrance.
  WearerEntrance(AccessBook& access, PhoneSource* source, std::string other);
  ~WearerEntrance() override;

  std::unique_ptr<Link> Open(const std::string& peer, std::shared_ptr<Out> out) override;
  /// Tells the phone what became of its picture. The tracker's thread.
  void OnTracked(const TrackedEvent& event);

 private:
  class Conversation;
  class PhoneLinkImpl;
  /// Makes `link` the one that has the camera. False: another phone has it.
  bool TakeOver(const std::shared_ptr<PhoneLinkImpl>& link);
  void Leave(const PhoneLinkImpl* link);
  /// A link without a hello yet. False: there are as many as may be, and it is not counted.
  bool Arrive(const std::string& peer);
  void Depart(const std::string& peer);

  AccessBook& access_;
  PhoneSource* const source_;
  const std::string other_;
  std::mutex mutex_;
  std::shared_ptr<PhoneLinkImpl> holder_;  // guarded by mutex_; null: no phone
  std::multiset<std::string> strangers_;   // guarded by mutex_: peers of links without a hello
};

/// Hands on what the engine tells, and the tracked frames to `entrance` as well.
class WearerTee final : public EventSink {
 public:
  explicit WearerTee(EventSink& next) : next_(next) {}
  /// Before the first event; it outlives the last one.
  void Connect(WearerEntrance* entrance) { entrance_ = entrance; }

  void OnTracked(const TrackedEvent& event) override {
    next_.OnTracked(event);
    if (entrance_ != nullptr) entrance_->OnTracked(event);
  }
  void OnVideo(const std::shared_ptr<const VideoPacket>& packet) override { next_.OnVideo(packet); }
  void OnStatistics(const EngineStatistics& statistics) override { next_.OnStatistics(statistics); }
  void OnGaze(const std::shared_ptr<const GazeSnapshot>& state) override { next_.OnGaze(state); }
  void OnEndOfSource(std::uint64_t frames) override { next_.OnEndOfSource(frames); }
  void OnPicturePause(const std::shared_ptr<const PicturePause>& state) override {
    next_.OnPicturePause(state);
  }
  void OnScene(const std::shared_ptr<const Scene>& scene) override { next_.OnScene(scene); }
  void OnSurface(const std::shared_ptr<const SurfaceSnapshot>& surface) override {
    next_.OnSurface(surface);
  }

 private:
  EventSink& next_;
  WearerEntrance* entrance_ = nullptr;
};

}  // namespace saccade
