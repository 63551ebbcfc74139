#include "server/rpc/session_service.hpp"

#include <absl/strings/str_cat.h>

#include "server/rpc/status.hpp"
#include "server/rpc/stream_writer.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

grpc::ServerUnaryReactor* Finish(grpc::ServerUnaryReactor* reactor, const absl::Status& status) {
  reactor->Finish(ToGrpc(status));
  return reactor;
}

// A stream that cannot start.
class RefusedStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedStream(const absl::Status& status) { Finish(ToGrpc(status)); }

 private:
  void OnDone() override { delete this; }
};

}  // namespace

SessionService::SessionService(Backend& backend, StreamHub& hub, Gatekeeper& gate)
    : backend_(backend), hub_(hub), gate_(gate), started_ns_(MonotonicNow()) {}

grpc::ServerUnaryReactor* SessionService::Join(grpc::CallbackServerContext* context,
                                               const v1::JoinRequest* request,
                                               v1::JoinResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::Status often = gate_.Anyone(*context, Toll::kJoin);
  const absl::StatusOr<Session> session =
      often.ok() ? gate_.sessions().Join(*request) : absl::StatusOr<Session>(often);
  Audit("Join", session.ok() ? session->participant_id : "", session.status());
  if (!session.ok()) return Finish(reactor, session.status());
  const ServerFacts& facts = backend_.facts();
  response->set_session_id(session->id);
  response->set_participant_id(session->participant_id);
  response->set_server_version(facts.version);
  response->set_source(facts.source);
  *response->mutable_intrinsics() = wire::ToProto(facts.camera->intrinsics());
  response->set_source_fps_hz(facts.camera->intrinsics().fps);
  return Finish(reactor, absl::OkStatus());
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* SessionService::Subscribe(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* encoded) {
  v1::SubscribeRequest request;
  grpc::ByteBuffer buffer = *encoded;  // the same bytes: reading one empties it
  if (!grpc::SerializationTraits<v1::SubscribeRequest>::Deserialize(&buffer, &request).ok()) {
    return new RefusedStream(absl::InvalidArgumentError("request: is no SubscribeRequest"));
  }
  const absl::StatusOr<Session> session =
      gate_.Member(*context, Toll::kSubscribe, request.session_id());
  if (!session.ok()) return new RefusedStream(session.status());
  const absl::StatusOr<SubscriptionOptions> options = SubscriptionOptions::FromProto(request);
  Audit("Subscribe", session->participant_id, options.status());
  if (!options.ok()) return new RefusedStream(options.status());
  return StreamWriter::Open(hub_, *session, *options, *context, gate_.sessions().Hold(session->id));
}

grpc::ServerUnaryReactor* SessionService::Acknowledge(grpc::CallbackServerContext* context,
                                                      const v1::AcknowledgeRequest* request,
                                                      v1::AcknowledgeResponse* /*response*/) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  // Costs nothing that could be limited.
  const absl::StatusOr<Session> session = gate_.sessions().Find(request->session_id());
  if (!session.ok()) return Finish(reactor, session.status());
  return Finish(reactor,
                hub_.Acknowledge(session->id, request->sequence(), request->request_key_frame()));
}

grpc::ServerUnaryReactor* SessionService::Ping(grpc::CallbackServerContext* context,
                                               const v1::PingRequest* request,
                                               v1::PingResponse* response) {
  response->set_server_receive_ns(MonotonicNow());
  response->set_client_send_ns(request->client_send_ns());
  response->set_server_send_ns(MonotonicNow());
  return Finish(context->DefaultReactor(), absl::OkStatus());
}

grpc::ServerUnaryReactor* SessionService::GetFrame(grpc::CallbackServerContext* context,
                                                   const v1::GetFrameRequest* request,
                                                   v1::GetFrameResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (absl::Status often = gate_.Anyone(*context, Toll::kStill); !often.ok()) {
    return Finish(reactor, often);
  }
  if (!v1::VideoView_IsValid(request->view())) {
    return Finish(reactor, absl::InvalidArgumentError(absl::StrCat(
                               "view: unknown view ", static_cast<int>(request->view()))));
  }
  std::optional<FrameId> frame_id;
  if (request->has_frame_id()) frame_id = request->frame_id();
  const VideoView view =
      request->view() == v1::VIDEO_VIEW_AUGMENTED ? VideoView::kAugmented : VideoView::kRaw;
  backend_.GetStill(frame_id, view, [reactor, response](const absl::StatusOr<Still>& still) {
    if (still.ok()) {
      const TrackedEvent& tracked = still->tracked;
      response->set_frame_id(tracked.snapshot->frame_id);
      response->set_png(*still->png);
      *response->mutable_intrinsics() = wire::ToProto(tracked.camera->intrinsics());
      *response->mutable_pose() = wire::ToProtoPose(*tracked.snapshot, tracked.stages.captured_ns);
    }
    reactor->Finish(ToGrpc(still.status()));
  });
  return reactor;
}

grpc::ServerUnaryReactor* SessionService::GetStatus(grpc::CallbackServerContext* context,
                                                    const v1::GetStatusRequest* /*request*/,
                                                    v1::GetStatusResponse* response) {
  if (absl::Status often = gate_.Anyone(*context, Toll::kRead); !often.ok()) {
    return Finish(context->DefaultReactor(), often);
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
  return Finish(context->DefaultReactor(), absl::OkStatus());
}

}  // namespace saccade
