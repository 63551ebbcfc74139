#include "client/net/connection.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <random>

#include "client/net/connection_impl.hpp"

namespace saccade::net {
namespace {

constexpr std::uint32_t kWindow = 32;  // events in flight unacknowledged
constexpr std::uint64_t kAcknowledgeEvery = 8;

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

absl::Status Connection::Impl::Watch(const std::function<bool(const WatchEvent&)>& on_event) {
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

absl::StatusOr<std::string> Connection::JoinAnew() {
  impl_->session_id_.clear();
  return Session();
}

const std::string& Connection::session_id() const { return impl_->session_id_; }

const Joined& Connection::joined() const { return impl_->joined_; }

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
absl::Status Connection::Watch(const std::function<bool(const WatchEvent&)>& on_event) {
  return impl_->Watch(on_event);
}

}  // namespace saccade::net
