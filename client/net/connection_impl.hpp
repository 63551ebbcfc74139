#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/net/channel.hpp"
#include "client/net/connection.hpp"
#include "client/net/convert.hpp"
#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/gaze.grpc.pb.h"
#include "saccade/v1/map.grpc.pb.h"
#include "saccade/v1/pointer.grpc.pb.h"
#include "saccade/v1/recording.grpc.pb.h"
#include "saccade/v1/replay.grpc.pb.h"
#include "saccade/v1/scene.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "saccade/v1/surface.grpc.pb.h"
#include "saccade/v1/talk.grpc.pb.h"

namespace saccade::net {

/// How calls are made; of this folder alone.
class Connection::Impl {
 public:
  static constexpr std::chrono::milliseconds kTryAgain{250};

  explicit Impl(const ConnectionOptions& options)
      : options_(options),
        session_id_(options.session_id),
        channel_(MakeChannel(options)),
        session_(v1::SessionService::NewStub(channel_)),
        map_(v1::MapService::NewStub(channel_)),
        annotation_(v1::AnnotationService::NewStub(channel_)),
        gaze_(v1::GazeService::NewStub(channel_)),
        pointer_(v1::PointerService::NewStub(channel_)),
        scene_(v1::SceneService::NewStub(channel_)),
        surface_(v1::SurfaceService::NewStub(channel_)),
        talk_(v1::TalkService::NewStub(channel_)),
        recording_(v1::RecordingService::NewStub(channel_)),
        replay_(v1::ReplayService::NewStub(channel_)) {}

  // One unary call with this connection's deadline.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request) {
    const auto give_up = std::chrono::system_clock::now() + options_.deadline;
    for (;;) {
      grpc::ClientContext context;
      context.set_deadline(give_up);
      Authorise(options_, context);
      Response response;
      const grpc::Status status = (stub.*method)(&context, request, &response);
      if (status.ok()) return response;
      if (!IsTooOften(status) || std::chrono::system_clock::now() + kTryAgain > give_up) {
        return Explain(status);
      }
      std::this_thread::sleep_for(kTryAgain);  // what was refused did nothing
    }
  }

  // Somebody at our address floods the server, perhaps we: it passes.
  static bool IsTooOften(const grpc::Status& status) {
    return status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
           status.error_details().find("google.rpc.RetryInfo") != std::string::npos;
  }

  // A call that names the session. If the server has forgotten it (it restarted), joins anew, once.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> CallInSession(Stub& stub,
                                         grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                                      const Request&, Response*),
                                         Request request) {
    const bool had_session = !session_id_.empty();
    if (absl::Status joined = Join(); !joined.ok()) return joined;
    request.set_session_id(session_id_);
    absl::StatusOr<Response> response = Call(stub, method, request);
    if (response.ok() || !had_session || !IsForgottenSession(response.status())) return response;
    session_id_.clear();
    if (absl::Status joined = Join(); !joined.ok()) return joined;
    request.set_session_id(session_id_);
    return Call(stub, method, request);
  }

  absl::Status Join() {
    if (!session_id_.empty()) return absl::OkStatus();
    v1::JoinRequest request;
    request.set_display_name(options_.display_name);
    request.set_role(ToProto(options_.role));
    request.set_person_key(options_.person_key);
    request.set_resume_session_id(options_.session_id);  // whose undo goes on, if it is known yet
    absl::StatusOr<v1::JoinResponse> response =
        Call(*session_, &v1::SessionService::Stub::Join, request);
    if (!response.ok()) return response.status();
    session_id_ = response->session_id();
    joined_ = {response->participant_id(), response->source(), response->server_version()};
    return absl::OkStatus();
  }

  absl::Status Explain(const grpc::Status& status) const { return net::Explain(options_, status); }

  static bool IsForgottenSession(const absl::Status& status) {
    return status.message().find("session_id") != absl::string_view::npos &&
           (absl::IsNotFound(status) || absl::IsFailedPrecondition(status) ||
            absl::IsUnauthenticated(status) || absl::IsInvalidArgument(status));
  }

  void Acknowledge(std::uint64_t sequence) {
    v1::AcknowledgeRequest request;
    request.set_session_id(session_id_);
    request.set_sequence(sequence);
    // A lost acknowledgement is made good by the next: they are cumulative.
    Call(*session_, &v1::SessionService::Stub::Acknowledge, request).IgnoreError();
  }

  absl::Status Watch(const std::function<bool(const WatchEvent&)>& on_event);
  absl::Status FollowChat(const std::function<bool(const ChatMessage&)>& on_message);
  absl::StatusOr<std::vector<ChatMessage>> Messages();

  const ConnectionOptions options_;
  std::string session_id_;
  Joined joined_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> session_;
  const std::unique_ptr<v1::MapService::Stub> map_;
  const std::unique_ptr<v1::AnnotationService::Stub> annotation_;
  const std::unique_ptr<v1::GazeService::Stub> gaze_;
  const std::unique_ptr<v1::PointerService::Stub> pointer_;
  const std::unique_ptr<v1::SceneService::Stub> scene_;
  const std::unique_ptr<v1::SurfaceService::Stub> surface_;
  const std::unique_ptr<v1::TalkService::Stub> talk_;
  const std::unique_ptr<v1::RecordingService::Stub> recording_;
  const std::unique_ptr<v1::ReplayService::Stub> replay_;
};

}  // namespace saccade::net
