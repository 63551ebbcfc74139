#include "client/net/connection.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <iterator>
#include <random>
#include <thread>
#include <utility>

#include "client/net/channel.hpp"
#include "client/net/convert.hpp"
#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/gaze.grpc.pb.h"
#include "saccade/v1/map.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/gaze.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {
namespace {

constexpr std::uint32_t kWindow = 32;  // events in flight unacknowledged
constexpr std::uint64_t kAcknowledgeEvery = 8;
constexpr int kMaxPages = 10000;  // of a list
constexpr std::chrono::milliseconds kTryAgain(250);

}  // namespace

std::string RandomUuid() {
  std::random_device device;
  std::uint32_t word[4];
  for (std::uint32_t& w : word) w = device();
  return absl::StrFormat("%08x-%04x-4%03x-%04x-%04x%08x", word[0], word[1] >> 16, word[1] & 0xfff,
                         0x8000 | ((word[2] >> 16) & 0x3fff), word[2] & 0xffff, word[3]);
}

absl::Status ConnectionOptions::Validate() const {
  const auto colon = server.rfind(':');
  int port = 0;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(server.substr(colon + 1), &port) || port < 1 || port > 65535) {
    return absl::InvalidArgumentError(
        absl::StrCat("server '", server, "' is not HOST:PORT, for example 127.0.0.1:50051"));
  }
  if (deadline.count() <= 0) return absl::InvalidArgumentError("the deadline must be above 0 s");
  return absl::OkStatus();
}

class Connection::Impl {
 public:
  explicit Impl(const ConnectionOptions& options)
      : options_(options),
        session_id_(options.session_id),
        channel_(MakeChannel(options)),
        session_(v1::SessionService::NewStub(channel_)),
        map_(v1::MapService::NewStub(channel_)),
        annotation_(v1::AnnotationService::NewStub(channel_)),
        gaze_(v1::GazeService::NewStub(channel_)) {}

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

  absl::Status Watch(const std::function<bool(const WatchEvent&)>& on_event) {
    if (absl::Status joined = Join(); !joined.ok()) return joined;
    v1::SubscribeRequest request;
    request.set_session_id(session_id_);
    request.set_window(kWindow);
    for (const v1::Topic topic :
         {v1::TOPIC_POSE, v1::TOPIC_ANNOTATION, v1::TOPIC_PRESENCE, v1::TOPIC_STATISTICS}) {
      request.add_topics(topic);
    }
    grpc::ClientContext context;
    Authorise(options_, context);
    const std::unique_ptr<grpc::ClientReader<v1::Event>> reader =
        session_->Subscribe(&context, request);
    v1::Event message;
    AnnotationParts parts;
    absl::Status failure;
    bool more = true;
    while (more && reader->Read(&message)) {
      if (message.sequence() % kAcknowledgeEvery == 0) Acknowledge(message.sequence());
      absl::StatusOr<std::optional<WatchEvent>> event = FromProto(message);
      if (!event.ok()) failure = event.status();
      if (event.ok() && message.has_annotation()) {
        *event =
            parts.Add(std::get<AnnotationChange>(**std::move(event)), message.annotation().more());
      }
      more = event.ok() && (!event->has_value() || on_event(**event));
    }
    if (!more) context.TryCancel();
    const grpc::Status status = reader->Finish();
    if (!more) return failure;
    return status.ok() ? absl::OkStatus() : Explain(status);
  }

  const ConnectionOptions options_;
  std::string session_id_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> session_;
  const std::unique_ptr<v1::MapService::Stub> map_;
  const std::unique_ptr<v1::AnnotationService::Stub> annotation_;
  const std::unique_ptr<v1::GazeService::Stub> gaze_;
};

Connection::Connection(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Connection::~Connection() = default;

absl::StatusOr<std::unique_ptr<Connection>> Connection::Create(const ConnectionOptions& options) {
  if (absl::Status valid = options.Validate(); !valid.ok()) return valid;
  return std::unique_ptr<Connection>(new Connection(std::make_unique<Impl>(options)));
}

absl::StatusOr<std::string> Connection::Session() {
  if (absl::Status joined = impl_->Join(); !joined.ok()) return joined;
  return impl_->session_id_;
}

const std::string& Connection::session_id() const { return impl_->session_id_; }

absl::StatusOr<ServerStatus> Connection::GetStatus() {
  auto response =
      impl_->Call(*impl_->session_, &v1::SessionService::Stub::GetStatus, v1::GetStatusRequest());
  if (!response.ok()) return response.status();
  return FromProto(*response);
}

absl::StatusOr<Still> Connection::GetFrame(std::optional<FrameId> frame_id, VideoView view) {
  v1::GetFrameRequest request;
  if (frame_id) request.set_frame_id(*frame_id);
  request.set_view(ToProto(view));
  auto response = impl_->Call(*impl_->session_, &v1::SessionService::Stub::GetFrame, request);
  if (!response.ok()) return response.status();
  return FromProto(*response);
}

absl::StatusOr<MapState> Connection::GetMap() {
  auto response = impl_->Call(*impl_->map_, &v1::MapService::Stub::Get, v1::GetMapRequest());
  if (!response.ok()) return response.status();
  return FromProto(*response);
}

absl::StatusOr<MapExport> Connection::ExportMap() {
  v1::ExportMapRequest request;
  request.set_format(v1::ExportMapRequest::FORMAT_PLY);
  auto response = impl_->Call(*impl_->map_, &v1::MapService::Stub::Export, request);
  if (!response.ok()) return response.status();
  return MapExport{std::move(*response->mutable_data()), response->feature_count()};
}

absl::StatusOr<std::uint64_t> Connection::ResetMap() {
  auto response =
      impl_->CallInSession(*impl_->map_, &v1::MapService::Stub::Reset, v1::ResetMapRequest());
  if (!response.ok()) return response.status();
  return response->map_generation();
}

absl::StatusOr<Annotation> Connection::CreateAnnotation(AnnotationDraft draft) {
  v1::CreateAnnotationRequest request;
  request.set_request_id(draft.request_id.empty() ? RandomUuid() : draft.request_id);
  *request.mutable_draft() = ToProto(draft);
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Create,
                                       std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<Annotation> Connection::UpdateAnnotation(const AnnotationPatch& patch) {
  v1::UpdateAnnotationRequest request;
  request.set_id(patch.id);
  if (patch.text) request.set_text(*patch.text);
  if (patch.size_m) request.set_size_m(*patch.size_m);
  if (patch.color_rgba) request.set_color_rgba(*patch.color_rgba);
  if (patch.target) *request.mutable_target() = wire::ToProto(*patch.target);
  if (patch.end_target) *request.mutable_end_target() = wire::ToProto(*patch.end_target);
  if (patch.locked) request.set_locked(*patch.locked);
  if (patch.world_from_mark) {
    *request.mutable_world_from_mark() = wire::ToProto(*patch.world_from_mark);
  }
  if (patch.extent_m) *request.mutable_extent_m() = wire::ToProto(*patch.extent_m);
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Update,
                                       std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<std::vector<Annotation>> Connection::ListAnnotations() {
  std::vector<Annotation> all;
  v1::ListAnnotationsRequest request;
  for (int page = 0; page < kMaxPages; ++page) {
    auto response = impl_->Call(*impl_->annotation_, &v1::AnnotationService::Stub::List, request);
    if (!response.ok()) return response.status();
    absl::StatusOr<std::vector<Annotation>> some = FromProto(response->annotations());
    if (!some.ok()) return some.status();
    std::move(some->begin(), some->end(), std::back_inserter(all));
    if (response->next_page_token().empty()) return all;
    if (response->next_page_token() == request.page_token()) break;
    request.set_page_token(response->next_page_token());
  }
  return absl::DataLossError(absl::StrCat("the list of annotations of ", impl_->options_.server,
                                          " does not end; is it another version?"));
}

absl::Status Connection::DeleteAnnotation(const std::string& id) {
  v1::DeleteAnnotationRequest request;
  request.set_id(id);
  return impl_
      ->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Delete, std::move(request))
      .status();
}

absl::StatusOr<Annotation> Connection::TickCheckItem(const std::string& id, std::uint32_t index,
                                                     bool done) {
  v1::TickCheckItemRequest request;
  request.set_id(id);
  request.set_index(index);
  request.set_done(done);
  auto response = impl_->CallInSession(
      *impl_->annotation_, &v1::AnnotationService::Stub::TickCheckItem, std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<Picture> Connection::GetPicture(const std::string& id) {
  v1::GetPictureRequest request;
  request.set_id(id);
  auto response = impl_->CallInSession(
      *impl_->annotation_, &v1::AnnotationService::Stub::GetPicture, std::move(request));
  if (!response.ok()) return response.status();
  return Picture{response->facts().sha256(), response->facts().media_type(),
                 static_cast<int>(response->facts().width()),
                 static_cast<int>(response->facts().height()),
                 std::move(*response->mutable_picture())};
}

absl::StatusOr<std::string> Connection::Undo() {
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Undo,
                                       v1::UndoAnnotationRequest());
  if (!response.ok()) return response.status();
  return response->description();
}

absl::StatusOr<std::string> Connection::Redo() {
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Redo,
                                       v1::RedoAnnotationRequest());
  if (!response.ok()) return response.status();
  return response->description();
}

absl::StatusOr<GazeSnapshot> Connection::GetGaze() {
  auto response =
      impl_->Call(*impl_->gaze_, &v1::GazeService::Stub::GetState, v1::GetGazeStateRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<Lease> Connection::AcquireLease(const std::string& lease_id) {
  v1::AcquireLeaseRequest request;
  request.set_lease_id(lease_id);
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::AcquireLease, std::move(request));
  if (!response.ok()) return response.status();
  return Lease{response->granted(),
               response->lease_id(),
               response->queue_position(),
               {response->pilot().participant_id(), response->pilot().display_name()}};
}

absl::Status Connection::ReleaseLease() {
  return impl_
      ->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::ReleaseLease,
                      v1::ReleaseLeaseRequest())
      .status();
}

absl::StatusOr<GazeSnapshot> Connection::Fixate(const GazeTarget& target, bool fast) {
  v1::FixateRequest request;
  *request.mutable_target() = wire::ToProto(target);
  request.set_fast(fast);
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::Fixate, std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::StopFixating() {
  auto response = impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::StopFixating,
                                       v1::StopFixatingRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::Home() {
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::Home, v1::HomeRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::CalibrateMount() {
  auto response = impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::CalibrateMount,
                                       v1::CalibrateMountRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<MountCalibrationReport> Connection::GetMountCalibration() {
  auto response = impl_->Call(*impl_->gaze_, &v1::GazeService::Stub::GetMountCalibration,
                              v1::GetMountCalibrationRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->calibration(), "calibration");
}

absl::Status Connection::Watch(const std::function<bool(const WatchEvent&)>& on_event) {
  return impl_->Watch(on_event);
}

}  // namespace saccade::net
