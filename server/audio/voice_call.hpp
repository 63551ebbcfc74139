#pragma once

#include <absl/status/status.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "saccade/v1/session.grpc.pb.h"
#include "saccade/v1/talk.grpc.pb.h"

namespace saccade {

/// One participant who only talks, as a client of the server. Send from one thread, Listen on
/// another.
class VoiceCall {
 public:
  VoiceCall(std::shared_ptr<grpc::Channel> channel, std::string token, std::string display_name);

  absl::Status Join();
  /// Hands on what is heard until the stream ends or Cancel().
  absl::Status Listen(const std::function<void(const v1::VoiceEvent&)>& on_voice);
  absl::Status Send(const std::vector<v1::VoicePacket>& packets);
  /// Ends Listen, also one that begins later. Any thread.
  void Cancel();

 private:
  std::unique_ptr<grpc::ClientContext> Context() const;
  std::string session_id() const;

  const std::string token_, display_name_;
  const std::unique_ptr<v1::SessionService::Stub> session_;
  const std::unique_ptr<v1::TalkService::Stub> talk_;
  mutable std::mutex mutex_;
  std::string session_id_;
  grpc::ClientContext* listening_ = nullptr;
  bool cancelled_ = false;
};

}  // namespace saccade
