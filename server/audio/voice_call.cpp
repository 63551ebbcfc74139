#include "server/audio/voice_call.hpp"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <utility>

namespace saccade {
namespace {

constexpr auto kDeadline = std::chrono::seconds(1);  // voice that is older is of no use

absl::Status ToStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace

VoiceCall::VoiceCall(std::shared_ptr<grpc::Channel> channel, std::string token,
                     std::string display_name)
    : token_(std::move(token)),
      display_name_(std::move(display_name)),
      session_(v1::SessionService::NewStub(channel)),
      talk_(v1::TalkService::NewStub(channel)) {}

std::unique_ptr<grpc::ClientContext> VoiceCall::Context() const {
  auto context = std::make_unique<grpc::ClientContext>();
  if (!token_.empty()) context->AddMetadata("authorization", absl::StrCat("Bearer ", token_));
  return context;
}

std::string VoiceCall::session_id() const {
  const std::lock_guard lock(mutex_);
  return session_id_;
}

absl::Status VoiceCall::Join() {
  v1::JoinRequest request;
  request.set_display_name(display_name_);
  request.set_role(v1::ROLE_WEARER);
  request.set_resume_session_id(session_id());
  v1::JoinResponse response;
  const auto context = Context();
  context->set_deadline(std::chrono::system_clock::now() + kDeadline);
  const grpc::Status status = session_->Join(context.get(), request, &response);
  const std::lock_guard lock(mutex_);
  if (status.ok()) session_id_ = response.session_id();
  return ToStatus(status);
}

absl::Status VoiceCall::Listen(const std::function<void(const v1::VoiceEvent&)>& on_voice) {
  const auto context = Context();
  {
    const std::lock_guard lock(mutex_);
    if (cancelled_) return absl::CancelledError("told to end");
    listening_ = context.get();
  }
  const absl::Cleanup forget = [this] {
    const std::lock_guard lock(mutex_);
    listening_ = nullptr;
  };
  v1::SubscribeRequest request;
  request.set_session_id(session_id());
  request.add_topics(v1::TOPIC_VOICE);
  const auto reader = session_->Subscribe(context.get(), request);
  v1::Event event;
  while (reader->Read(&event)) {
    if (event.has_voice()) on_voice(event.voice());
    v1::AcknowledgeRequest acknowledge;
    acknowledge.set_session_id(request.session_id());
    acknowledge.set_sequence(event.sequence());
    v1::AcknowledgeResponse acknowledged;
    const auto brief = Context();
    brief->set_deadline(std::chrono::system_clock::now() + kDeadline);
    if (!session_->Acknowledge(brief.get(), acknowledge, &acknowledged).ok()) break;
  }
  context->TryCancel();  // a stream that is not read any more
  return ToStatus(reader->Finish());
}

absl::Status VoiceCall::Send(const std::vector<v1::VoicePacket>& packets) {
  v1::SpeakRequest request;
  request.set_session_id(session_id());
  if (request.session_id().empty()) return absl::FailedPreconditionError("has not joined");
  for (const v1::VoicePacket& packet : packets) *request.add_packets() = packet;
  v1::SpeakResponse response;
  const auto context = Context();
  context->set_deadline(std::chrono::system_clock::now() + kDeadline);
  return ToStatus(talk_->Speak(context.get(), request, &response));
}

void VoiceCall::Cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (listening_) listening_->TryCancel();
}

}  // namespace saccade
