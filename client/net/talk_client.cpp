#include "client/net/talk_client.hpp"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <utility>

#include "client/net/channel.hpp"
#include "client/net/convert.hpp"
#include "saccade/v1/session.grpc.pb.h"
#include "saccade/v1/talk.grpc.pb.h"

namespace saccade::net {
namespace {

ChatMessage FromProto(const v1::ChatMessage& message) {
  return {message.number(), message.display_name(), message.text(), message.annotation_id(),
          message.sent_unix_ns()};
}

}  // namespace

class TalkClient::Impl {
 public:
  explicit Impl(const ConnectionOptions& options)
      : options_(options),
        session_id_(options.session_id),
        channel_(MakeChannel(options)),
        session_(v1::SessionService::NewStub(channel_)),
        talk_(v1::TalkService::NewStub(channel_)) {}

  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + options_.deadline);
    Authorise(options_, context);
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (!status.ok()) return Explain(options_, status);
    return response;
  }

  absl::Status Join() {
    v1::JoinRequest request;
    request.set_display_name(options_.display_name);
    request.set_role(ToProto(options_.role));
    request.set_resume_session_id(session_id_);
    const auto joined = Call(*session_, &v1::SessionService::Stub::Join, request);
    if (!joined.ok()) return joined.status();
    session_id_ = joined->session_id();
    return absl::OkStatus();
  }

  absl::StatusOr<v1::ListMessagesResponse> List() {
    v1::ListMessagesRequest request;
    request.set_session_id(session_id_);
    return Call(*talk_, &v1::TalkService::Stub::ListMessages, request);
  }

  absl::Status Follow(const std::function<bool(const ChatMessage&)>& on_message) {
    v1::SubscribeRequest request;
    request.set_session_id(session_id_);
    request.add_topics(v1::TOPIC_CHAT);
    request.add_topics(
        v1::TOPIC_PRESENCE);  // tells that the stream is open, also where all is quiet
    grpc::ClientContext context;
    Authorise(options_, context);
    const auto reader = session_->Subscribe(&context, request);
    std::uint64_t told = 0;
    bool listed = false, more = true;
    const auto tell = [&](const auto& messages) {
      for (const v1::ChatMessage& message : messages) {
        if (!more || message.number() <= told) continue;
        told = message.number();
        more = on_message(FromProto(message));
      }
    };
    v1::Event event;
    while (more && reader->Read(&event)) {
      v1::AcknowledgeRequest acknowledge;
      acknowledge.set_session_id(session_id_);
      acknowledge.set_sequence(event.sequence());
      Call(*session_, &v1::SessionService::Stub::Acknowledge, acknowledge).IgnoreError();
      if (!std::exchange(listed, true)) {  // after the stream was open: nothing falls between
        const auto kept = List();
        if (!kept.ok()) {
          context.TryCancel();
          reader->Finish().ok();
          return kept.status();
        }
        tell(kept->messages());
      }
      tell(event.chat().messages());
    }
    if (!more) context.TryCancel();
    const grpc::Status status = reader->Finish();
    return !more || status.ok() ? absl::OkStatus() : Explain(options_, status);
  }

  const ConnectionOptions options_;
  std::string session_id_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> session_;
  const std::unique_ptr<v1::TalkService::Stub> talk_;
};

TalkClient::TalkClient(const ConnectionOptions& options) : impl_(std::make_unique<Impl>(options)) {}
TalkClient::~TalkClient() = default;

absl::Status TalkClient::Join() { return impl_->Join(); }
const std::string& TalkClient::session_id() const { return impl_->session_id_; }

absl::StatusOr<ChatMessage> TalkClient::Say(const std::string& text,
                                            const std::string& annotation_id) {
  v1::SayRequest request;
  request.set_session_id(impl_->session_id_);
  request.set_request_id(RandomUuid());
  request.set_text(text);
  request.set_annotation_id(annotation_id);
  const auto said = impl_->Call(*impl_->talk_, &v1::TalkService::Stub::Say, request);
  if (!said.ok()) return said.status();
  return FromProto(said->message());
}

absl::StatusOr<std::vector<ChatMessage>> TalkClient::Messages() {
  const auto kept = impl_->List();
  if (!kept.ok()) return kept.status();
  std::vector<ChatMessage> all;
  for (const v1::ChatMessage& message : kept->messages()) all.push_back(FromProto(message));
  return all;
}

absl::Status TalkClient::Follow(const std::function<bool(const ChatMessage&)>& on_message) {
  return impl_->Follow(on_message);
}

absl::StatusOr<PicturePause> TalkClient::PausePicture(bool paused) {
  v1::PausePictureRequest request;
  request.set_session_id(impl_->session_id_);
  request.set_paused(paused);
  const auto done = impl_->Call(*impl_->session_, &v1::SessionService::Stub::PausePicture, request);
  if (!done.ok()) return done.status();
  const v1::PicturePause& state = done->picture_pause();
  return PicturePause{state.paused(), state.by(), state.since_unix_ns()};
}

}  // namespace saccade::net
