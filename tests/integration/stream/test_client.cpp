#include "tests/integration/stream/test_client.hpp"

#include <cstdio>
#include <cstdlib>

namespace saccade::testing {
namespace {

void Must(const grpc::Status& status, const char* what) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s: %s\n", what, status.error_message().c_str());
  std::abort();
}

}  // namespace

TestClient::TestClient(const std::string& address, v1::Role role) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a socket of its own
  arguments.SetInt("grpc.http2.bdp_probe", 0);
  arguments.SetMaxReceiveMessageSize(-1);
  const auto channel =
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  session_ = v1::SessionService::NewStub(channel);
  annotations_ = v1::AnnotationService::NewStub(channel);
  map_ = v1::MapService::NewStub(channel);
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  v1::JoinRequest request;
  request.set_display_name("tester");
  request.set_role(role);
  v1::JoinResponse response;
  Must(session_->Join(&context, request, &response), "Join");
  session_id_ = response.session_id();
  participant_id_ = response.participant_id();
}

void TestClient::Subscribe(v1::SubscribeRequest request, bool acknowledge) {
  request.set_session_id(session_id_);
  context_ = std::make_unique<grpc::ClientContext>();
  reader_ = session_->Subscribe(context_.get(), request);
  leaving_ = false;
  thread_ = std::thread([this, acknowledge] { Read(acknowledge); });
}

void TestClient::Read(bool acknowledge) {
  v1::Event event;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !paused_ || leaving_; });
    }
    if (!reader_->Read(&event)) break;
    {
      const std::lock_guard lock(mutex_);
      events_.push_back({event, MonotonicNow()});
    }
    changed_.notify_all();
    if (acknowledge) Acknowledge(event.sequence());
  }
  end_ = reader_->Finish();
}

void TestClient::PauseReading(bool paused) {
  {
    const std::lock_guard lock(mutex_);
    paused_ = paused;
  }
  changed_.notify_all();
}

void TestClient::Acknowledge(std::uint64_t sequence, bool request_key_frame) {
  grpc::ClientContext context;
  v1::AcknowledgeRequest request;
  request.set_session_id(session_id_);
  request.set_sequence(sequence);
  request.set_request_key_frame(request_key_frame);
  v1::AcknowledgeResponse response;
  // May fail while the stream ends.
  session_->Acknowledge(&context, request, &response);
}

grpc::Status TestClient::WaitForEnd() {
  if (thread_.joinable()) thread_.join();
  return end_;
}

grpc::Status TestClient::Leave() {
  {
    const std::lock_guard lock(mutex_);
    leaving_ = true;
  }
  changed_.notify_all();
  if (context_ != nullptr) context_->TryCancel();
  return WaitForEnd();
}

std::vector<ReceivedEvent> TestClient::events() const {
  const std::lock_guard lock(mutex_);
  return events_;
}

bool TestClient::WaitFor(const std::function<bool(const std::vector<ReceivedEvent>&)>& wanted,
                         std::chrono::milliseconds limit) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, limit, [&] { return wanted(events_); });
}

v1::AnnotationDraft TestClient::CubeAt(double u, double v, std::uint64_t frame_id) const {
  v1::AnnotationDraft draft;
  draft.set_shape(v1::ANNOTATION_SHAPE_CUBE);
  v1::FramePixel& target = *draft.mutable_target()->mutable_frame_pixel();
  target.set_frame_id(frame_id);
  target.mutable_pixel()->set_u(u);
  target.mutable_pixel()->set_v(v);
  return draft;
}

grpc::Status TestClient::Create(const v1::AnnotationDraft& draft, const std::string& request_id,
                                v1::CreateAnnotationResponse& response) {
  grpc::ClientContext context;
  v1::CreateAnnotationRequest request;
  request.set_session_id(session_id_);
  request.set_request_id(request_id);
  *request.mutable_draft() = draft;
  return annotations_->Create(&context, request, &response);
}

std::uint64_t TestClient::NewestFrame() {
  grpc::ClientContext context;
  v1::GetStatusResponse response;
  Must(session_->GetStatus(&context, {}, &response), "GetStatus");
  return response.pose().frame_id();
}

}  // namespace saccade::testing
