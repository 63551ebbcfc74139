// What is said and pointed at, and the pause of the picture.
#include "client/net/connection_impl.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {

absl::StatusOr<std::vector<ChatMessage>> Connection::Impl::Messages() {
  auto kept =
      CallInSession(*talk_, &v1::TalkService::Stub::ListMessages, v1::ListMessagesRequest());
  if (!kept.ok()) return kept.status();
  return FromProto(kept->messages());
}

absl::Status Connection::Impl::FollowChat(
    const std::function<bool(const ChatMessage&)>& on_message) {
  if (absl::Status joined = Join(); !joined.ok()) return joined;
  v1::SubscribeRequest request;
  request.set_session_id(session_id_);
  request.add_topics(v1::TOPIC_CHAT);
  request.add_topics(v1::TOPIC_PRESENCE);  // tells that the stream is open, also where all is quiet
  grpc::ClientContext context;
  Authorise(options_, context);
  const auto reader = session_->Subscribe(&context, request);
  std::uint64_t told = 0;
  bool listed = false, more = true;
  const auto tell = [&](const std::vector<ChatMessage>& messages) {
    for (const ChatMessage& message : messages) {
      if (!more || message.number <= told) continue;
      told = message.number;
      more = on_message(message);
    }
  };
  v1::Event event;
  while (more && reader->Read(&event)) {
    Acknowledge(event.sequence());
    if (!std::exchange(listed, true)) {  // after the stream was open: nothing falls between
      const auto kept = Messages();
      if (!kept.ok()) {
        context.TryCancel();
        reader->Finish().ok();
        return kept.status();
      }
      tell(*kept);
    }
    tell(FromProto(event.chat().messages()));
  }
  if (!more) context.TryCancel();
  const grpc::Status status = reader->Finish();
  return !more || status.ok() ? absl::OkStatus() : Explain(status);
}

absl::StatusOr<ChatMessage> Connection::Say(const std::string& text,
                                            const std::string& annotation_id) {
  v1::SayRequest request;
  request.set_request_id(RandomUuid());
  request.set_text(text);
  request.set_annotation_id(annotation_id);
  auto said = impl_->CallInSession(*impl_->talk_, &v1::TalkService::Stub::Say, std::move(request));
  if (!said.ok()) return said.status();
  return FromProto(said->message());
}

absl::StatusOr<std::vector<ChatMessage>> Connection::Messages() { return impl_->Messages(); }

absl::Status Connection::FollowChat(const std::function<bool(const ChatMessage&)>& on_message) {
  return impl_->FollowChat(on_message);
}

absl::StatusOr<PicturePause> Connection::PausePicture(bool paused) {
  v1::PausePictureRequest request;
  request.set_paused(paused);
  auto done = impl_->CallInSession(*impl_->session_, &v1::SessionService::Stub::PausePicture,
                                   std::move(request));
  if (!done.ok()) return done.status();
  return FromProto(done->picture_pause());
}

absl::Status Connection::Point(const PointerWord& word) {
  v1::PointRequest request;
  request.set_kind(word.sketch ? v1::POINTER_KIND_SKETCH : v1::POINTER_KIND_LASER);
  request.set_stroke_id(word.stroke_id);
  for (const AnnotationTarget& target : word.targets) {
    *request.add_points() = wire::ToProto(target);
  }
  request.set_released(word.released);
  request.set_color_rgba(word.color_rgba);
  return impl_
      ->CallInSession(*impl_->pointer_, &v1::PointerService::Stub::Point, std::move(request))
      .status();
}

}  // namespace saccade::net
