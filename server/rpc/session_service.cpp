#include "server/rpc/session_service.hpp"

#include <absl/strings/str_cat.h>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/status.hpp"
#include "server/rpc/stream_writer.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr char kSubscribe[] = "SessionService/Subscribe";

// A stream that cannot start.
class RefusedStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedStream(const absl::Status& status) { Finish(ToGrpc(status)); }

 private:
  void OnDone() override { delete this; }
};

}  // namespace

SessionService::SessionService(Backend& backend, StreamHub& hub, Gatekeeper& gate)
    : backend_(backend), hub_(hub), gate_(gate), started_ns_(MonotonicNow()) {
  // By their numbers in the proto; limits_test calls every one, and Subscribe gets its bytes
  // unparsed.
  MarkMethodCallback(0, Early(gate, "SessionService/Join", this, &SessionService::Join));
  MarkMethodCallback(2,
                     Early(gate, "SessionService/Acknowledge", this, &SessionService::Acknowledge));
  MarkMethodCallback(3, Early(gate, "SessionService/Ping", this, &SessionService::Ping));
  MarkMethodCallback(4, Early(gate, "SessionService/GetFrame", this, &SessionService::GetFrame));
  MarkMethodCallback(5, Early(gate, "SessionService/GetStatus", this, &SessionService::GetStatus));
  MarkMethodCallback(
      6, Early(gate, "SessionService/PausePicture", this, &SessionService::PausePicture));
}

grpc::ServerUnaryReactor* SessionService::Join(grpc::CallbackServerContext* context,
                                               const v1::JoinRequest* request,
                                               v1::JoinResponse* response) {
  UnaryCall call(*context, "SessionService/Join", UnaryCall::Log::kAll);
  const absl::StatusOr<Access> access = call.Enter(gate_, Toll::kJoin);
  if (!access.ok()) return call.Finish(access.status());
  const absl::StatusOr<Session> session = gate_.sessions().Join(*request, MonotonicNow(), *access);
  if (!session.ok()) return call.Finish(session.status());
  call.Is(*session);
  const ServerFacts& facts = backend_.facts();
  response->set_session_id(session->id);
  response->set_participant_id(session->participant_id);
  response->set_person_id(session->person_id);
  response->set_color_rgba(session->color_rgba);
  response->set_server_version(facts.version);
  response->set_source(facts.source);
  *response->mutable_intrinsics() = wire::ToProto(facts.camera->intrinsics());
  response->set_source_fps_hz(facts.camera->intrinsics().fps);
  return call.Finish(absl::OkStatus());
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* SessionService::Subscribe(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* encoded) {
  const absl::Status early = gate_.Arrive(*context, encoded->Length());
  if (!early.ok()) {
    Audit(kSubscribe, "", early);
    return new RefusedStream(early);
  }
  v1::SubscribeRequest request;
  grpc::ByteBuffer buffer = *encoded;  // the same bytes: reading one empties it
  if (!grpc::SerializationTraits<v1::SubscribeRequest>::Deserialize(&buffer, &request).ok()) {
    return new RefusedStream(absl::InvalidArgumentError("request: is no SubscribeRequest"));
  }
  const absl::StatusOr<Session> session =
      gate_.Member(*context, kSubscribe, Toll::kSubscribe, request.session_id());
  if (!session.ok()) return new RefusedStream(session.status());
  const absl::StatusOr<SubscriptionOptions> options = SubscriptionOptions::FromProto(request);
  Audit(kSubscribe, session->participant_id, options.status());
  if (!options.ok()) return new RefusedStream(options.status());
  StreamWriter* stream =
      StreamWriter::Open(hub_, *session, *options, *context, gate_.sessions().Hold(session->id));
  // Whose token ended between the check and the hub's knowing of the stream.
  const auto still = gate_.Enter(*context, kSubscribe, std::nullopt);
  if (!still.ok()) hub_.End({session->access_id}, still.status());
  return stream;
}

grpc::ServerUnaryReactor* SessionService::Acknowledge(grpc::CallbackServerContext* context,
                                                      const v1::AcknowledgeRequest* request,
                                                      v1::AcknowledgeResponse* /*response*/) {
  UnaryCall call(*context, "SessionService/Acknowledge", UnaryCall::Log::kNothing);
  // Costs nothing that could be limited.
  const absl::StatusOr<Session> session =
      gate_.Member(*context, "SessionService/Acknowledge", std::nullopt, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  return call.Finish(
      hub_.Acknowledge(session->id, request->sequence(), request->request_key_frame()));
}

grpc::ServerUnaryReactor* SessionService::Ping(grpc::CallbackServerContext* context,
                                               const v1::PingRequest* request,
                                               v1::PingResponse* response) {
  UnaryCall call(*context, "SessionService/Ping", UnaryCall::Log::kNothing);
  if (const auto access = call.Enter(gate_, std::nullopt); !access.ok()) {
    return call.Finish(access.status());
  }
  response->set_server_receive_ns(MonotonicNow());
  response->set_client_send_ns(request->client_send_ns());
  response->set_server_send_ns(MonotonicNow());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* SessionService::GetFrame(grpc::CallbackServerContext* context,
                                                   const v1::GetFrameRequest* request,
                                                   v1::GetFrameResponse* response) {
  UnaryCall call(*context, "SessionService/GetFrame", UnaryCall::Log::kNothing);
  if (const auto access = call.Enter(gate_, Toll::kStill); !access.ok()) {
    return call.Finish(access.status());
  }
  if (!v1::VideoView_IsValid(request->view())) {
    return call.Finish(absl::InvalidArgumentError(
        absl::StrCat("view: unknown view ", static_cast<int>(request->view()))));
  }
  std::optional<FrameId> frame_id;
  if (request->has_frame_id()) frame_id = request->frame_id();
  const VideoView view =
      request->view() == v1::VIDEO_VIEW_AUGMENTED ? VideoView::kAugmented : VideoView::kRaw;
  const auto fill = [response](const Still& still) {
    const TrackedEvent& tracked = still.tracked;
    response->set_frame_id(tracked.snapshot->frame_id);
    response->set_png(*still.png);
    *response->mutable_intrinsics() = wire::ToProto(tracked.camera->intrinsics());
    *response->mutable_pose() = wire::ToProtoPose(*tracked.snapshot, tracked.stages.captured_ns);
  };
  backend_.GetStill(frame_id, view, call.Answer<Still>(fill));
  return call.reactor();
}

grpc::ServerUnaryReactor* SessionService::GetStatus(grpc::CallbackServerContext* context,
                                                    const v1::GetStatusRequest* /*request*/,
                                                    v1::GetStatusResponse* response) {
  UnaryCall call(*context, "SessionService/GetStatus", UnaryCall::Log::kNothing);
  if (const auto access = call.Enter(gate_, Toll::kRead); !access.ok()) {
    return call.Finish(access.status());
  }
  if (const std::optional<TrackedEvent> newest = hub_.newest()) {
    *response->mutable_pose() = wire::ToProtoPose(*newest->snapshot, newest->stages.captured_ns);
    response->set_map_features(static_cast<std::uint32_t>(newest->snapshot->features.size()));
    response->set_annotations(static_cast<std::uint32_t>(newest->annotations->size()));
  }
  *response->mutable_statistics() = StatisticsToProto(hub_.statistics(), 0);
  *response->mutable_presence() = *hub_.presence();
  response->set_source(backend_.facts().source);
  response->set_server_version(backend_.facts().version);
  response->set_uptime_s(Seconds(MonotonicNow() - started_ns_));
  response->set_source_ended(hub_.end_of_source().has_value());
  *response->mutable_picture_pause() = PicturePauseToProto(*backend_.picture_pause());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* SessionService::PausePicture(grpc::CallbackServerContext* context,
                                                       const v1::PausePictureRequest* request,
                                                       v1::PausePictureResponse* response) {
  UnaryCall call(*context, "SessionService/PausePicture", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (session->role != v1::ROLE_WEARER) {
    return call.Finish(absl::PermissionDeniedError(
        "session_id: only the wearer pauses the picture: join as wearer"));
  }
  call.set_outcome(request->paused() ? "ok: paused" : "ok: lifted");
  const auto fill = [response](const PicturePause& state) {
    *response->mutable_picture_pause() = PicturePauseToProto(state);
  };
  backend_.PausePicture(request->paused(), session->display_name, call.Answer<PicturePause>(fill));
  return call.reactor();
}

}  // namespace saccade
