#pragma once

#include "saccade/v1/talk.grpc.pb.h"
#include "server/pipeline/rate_limiter.hpp"
#include "server/rpc/backend.hpp"
#include "server/rpc/chat_book.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// Chat, which is kept while the server runs, and voice, which is handed on and kept nowhere.
/// Handlers run on gRPC's threads and never block.
class TalkService final : public v1::TalkService::CallbackService {
 public:
  static constexpr std::size_t kMaxTextBytes = 500;
  static constexpr int kMaxPackets = 25;             // of one Speak: half a second
  static constexpr std::size_t kMaxOpusBytes = 400;  // of one packet: 160 kbit/s

  /// `packets`: of voice, by one speaker.
  TalkService(Backend& backend, StreamHub& hub, Gatekeeper& gate, const RateLimit& packets);

 private:
  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* Say(Context* context, const v1::SayRequest* request,
                                v1::SayResponse* response) override;
  grpc::ServerUnaryReactor* ListMessages(Context* context, const v1::ListMessagesRequest* request,
                                         v1::ListMessagesResponse* response) override;
  grpc::ServerUnaryReactor* Speak(Context* context, const v1::SpeakRequest* request,
                                  v1::SpeakResponse* response) override;

  absl::Status CheckMessage(const v1::SayRequest& request) const;

  Backend& backend_;
  StreamHub& hub_;
  Gatekeeper& gate_;
  ChatBook chat_;
  RateLimiter packets_;
};

}  // namespace saccade
