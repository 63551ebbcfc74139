#include "client/net/stream.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

#include "client/net/channel.hpp"
#include "client/net/convert.hpp"
#include "client/net/picture_reader.hpp"
#include "client/net/scene_convert.hpp"
#include "saccade/v1/session.grpc.pb.h"
#include "saccade/v1/talk.grpc.pb.h"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/gaze.hpp"

namespace saccade::net {
namespace {

constexpr std::chrono::milliseconds kDeadline(3000);
constexpr std::chrono::milliseconds kVoiceDeadline(1000);  // what is older is of no use

Presence PresenceOf(const v1::PresenceEvent& message) {
  Presence presence{net::FromProto(message), {}};
  for (const v1::Participant& each : message.participants()) {
    if (each.listens()) presence.listeners.push_back(each.participant_id());
  }
  return presence;
}

VoiceNews FromProto(const v1::VoiceEvent& message) {
  VoiceNews news{message.participant_id(), {}};
  for (const v1::VoicePacket& packet : message.packets()) {
    news.packets.push_back({packet.sequence(), packet.capture_ns(), packet.opus()});
  }
  return news;
}

absl::StatusOr<MapChange> FromProto(const v1::MapDelta& message) {
  MapChange change{.generation = message.map_generation(),
                   .revision = message.map_revision(),
                   .full = message.full(),
                   .upserted = {},
                   .removed_ids = {message.removed_ids().begin(), message.removed_ids().end()}};
  for (int i = 0; i < message.upserted_size(); ++i) {
    absl::StatusOr<FeatureSnapshot> feature =
        wire::FromProto(message.upserted(i), absl::StrCat("map.upserted[", i, "]"));
    if (!feature.ok()) return feature.status();
    change.upserted.push_back(*std::move(feature));
  }
  return change;
}

absl::StatusOr<std::vector<PointerNews>> FromProto(const v1::PointerEvent& message) {
  std::vector<PointerNews> all;
  for (int i = 0; i < message.pointers_size(); ++i) {
    const v1::Pointer& pointer = message.pointers(i);
    PointerNews news{.participant_id = pointer.participant_id(),
                     .display_name = pointer.display_name(),
                     .stroke_id = pointer.stroke_id(),
                     .sketch = pointer.kind() == v1::POINTER_KIND_SKETCH,
                     .color_rgba = pointer.color_rgba(),
                     .first = pointer.first(),
                     .points_in_world = {},
                     .released = pointer.released()};
    for (const v1::Vector3& point : pointer.points_in_world_m()) {
      absl::StatusOr<Eigen::Vector3d> at =
          wire::FromProto(point, absl::StrCat("pointer.pointers[", i, "].points_in_world_m"));
      if (!at.ok()) return at.status();
      news.points_in_world.push_back(*at);
    }
    if (!news.points_in_world.empty() || news.released) all.push_back(std::move(news));
  }
  return all;
}

}  // namespace

class Stream::Impl {
 public:
  Impl(const ConnectionOptions& options, std::string session_id, bool voice)
      : options_(options),
        session_id_(std::move(session_id)),
        voice_(voice),
        channel_(MakeChannel(options)),
        stub_(v1::SessionService::NewStub(channel_)),
        talk_(v1::TalkService::NewStub(channel_)) {
    Authorise(options_, context_);
  }

  absl::Status Read(
      const std::function<void(std::uint64_t, std::optional<StreamEvent>)>& on_event) {
    v1::SubscribeRequest request;
    request.set_session_id(session_id_);
    request.set_window(kWindow);
    request.set_video_view(v1::VIDEO_VIEW_RAW);
    for (const v1::Topic topic :
         {v1::TOPIC_POSE, v1::TOPIC_MAP, v1::TOPIC_VIDEO, v1::TOPIC_ANNOTATION, v1::TOPIC_GAZE,
          v1::TOPIC_PRESENCE, v1::TOPIC_STATISTICS, v1::TOPIC_POINTER, v1::TOPIC_CHAT,
          v1::TOPIC_PICTURE_PAUSE, v1::TOPIC_SCENE, v1::TOPIC_SURFACE}) {
      request.add_topics(topic);
    }
    if (voice_) request.add_topics(v1::TOPIC_VOICE);
    const auto reader = stub_->Subscribe(&context_, request);
    v1::Event message;
    absl::Status failure;
    while (failure.ok() && reader->Read(&message)) {
      absl::StatusOr<std::optional<StreamEvent>> event = Convert(message);
      if (!event.ok()) {
        failure = event.status();
        context_.TryCancel();
      } else {
        on_event(message.sequence(), *std::move(event));
      }
    }
    const grpc::Status status = reader->Finish();
    if (!failure.ok()) return failure;
    return status.ok() ? absl::OkStatus() : Explain(options_, status);
  }

  void Cancel() { context_.TryCancel(); }

  template <typename Request, typename Response>
  absl::Status Call(grpc::Status (v1::SessionService::Stub::*method)(grpc::ClientContext*,
                                                                     const Request&, Response*),
                    const Request& request, Response& response) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kDeadline);
    Authorise(options_, context);
    const grpc::Status status = ((*stub_).*method)(&context, request, &response);
    return status.ok() ? absl::OkStatus() : Explain(options_, status);
  }

  absl::Status Speak(const v1::SpeakRequest& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kVoiceDeadline);
    Authorise(options_, context);
    v1::SpeakResponse response;
    const grpc::Status status = talk_->Speak(&context, request, &response);
    return status.ok() ? absl::OkStatus() : Explain(options_, status);
  }

  const std::string& session_id() const { return session_id_; }

 private:
  absl::StatusOr<std::optional<StreamEvent>> Convert(const v1::Event& message) {
    switch (message.event_case()) {
      case v1::Event::kPose:
        return Wrap(wire::FromProto(message.pose(), "pose"));
      case v1::Event::kMap:
        return Wrap(FromProto(message.map()));
      case v1::Event::kAccessUnit:
        return Wrap(pictures_.Read(message.access_unit(), MonotonicNow()));
      case v1::Event::kAnnotation: {
        absl::StatusOr<AnnotationChange> part = net::FromProto(message.annotation());
        if (!part.ok()) return part.status();
        std::optional<AnnotationChange> whole =
            parts_.Add(*std::move(part), message.annotation().more());
        if (!whole) return std::optional<StreamEvent>();
        return std::optional<StreamEvent>(*std::move(whole));
      }
      case v1::Event::kGaze:
        return Wrap(wire::FromProto(message.gaze(), "gaze"));
      case v1::Event::kPointer:
        return Wrap(FromProto(message.pointer()));
      case v1::Event::kChat:
        return std::optional<StreamEvent>(net::FromProto(message.chat().messages()));
      case v1::Event::kVoice:
        return std::optional<StreamEvent>(FromProto(message.voice()));
      case v1::Event::kPicturePause:
        return std::optional<StreamEvent>(net::FromProto(message.picture_pause()));
      case v1::Event::kScene:
        return Wrap(net::FromProto(message.scene()));
      case v1::Event::kSurface:
        return std::optional<StreamEvent>(
            SurfaceNews{message.surface().edition(), message.surface().version()});
      case v1::Event::kStatistics:
        return std::optional<StreamEvent>(net::FromProto(message.statistics()));
      case v1::Event::kPresence:
        return std::optional<StreamEvent>(PresenceOf(message.presence()));
      case v1::Event::kEndOfSource:
        return std::optional<StreamEvent>(SourceEnd{message.end_of_source().frames()});
      default:
        return std::optional<StreamEvent>();
    }
  }

  template <typename T>
  static absl::StatusOr<std::optional<StreamEvent>> Wrap(absl::StatusOr<T> value) {
    if (!value.ok()) return value.status();
    return std::optional<StreamEvent>(*std::move(value));
  }

  const ConnectionOptions options_;
  const std::string session_id_;
  const bool voice_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> stub_;
  const std::unique_ptr<v1::TalkService::Stub> talk_;
  grpc::ClientContext context_;
  PictureReader pictures_;
  AnnotationParts parts_;
};

Stream::Stream(const ConnectionOptions& options, std::string session_id, bool voice)
    : impl_(std::make_unique<Impl>(options, std::move(session_id), voice)) {}
Stream::~Stream() = default;

absl::Status Stream::Read(
    const std::function<void(std::uint64_t, std::optional<StreamEvent>)>& on_event) {
  return impl_->Read(on_event);
}

void Stream::Cancel() { impl_->Cancel(); }

absl::Status Stream::Acknowledge(std::uint64_t sequence, bool request_key_frame) {
  v1::AcknowledgeRequest request;
  request.set_session_id(impl_->session_id());
  request.set_sequence(sequence);
  request.set_request_key_frame(request_key_frame);
  v1::AcknowledgeResponse response;
  return impl_->Call(&v1::SessionService::Stub::Acknowledge, request, response);
}

absl::Status Stream::Speak(const std::vector<VoicePacket>& packets) {
  v1::SpeakRequest request;
  request.set_session_id(impl_->session_id());
  for (const VoicePacket& packet : packets) {
    v1::VoicePacket& sent = *request.add_packets();
    sent.set_sequence(packet.sequence);
    sent.set_capture_ns(packet.capture_ns);
    sent.set_opus(packet.opus);
  }
  return impl_->Speak(request);
}

absl::StatusOr<PingTimes> Stream::Ping() {
  v1::PingRequest request;
  PingTimes times{.sent_ns = MonotonicNow()};
  request.set_client_send_ns(times.sent_ns);
  v1::PingResponse response;
  const absl::Status status = impl_->Call(&v1::SessionService::Stub::Ping, request, response);
  times.answered_ns = MonotonicNow();
  if (!status.ok()) return status;
  times.received_ns = response.server_receive_ns();
  times.replied_ns = response.server_send_ns();
  return times;
}

}  // namespace saccade::net
