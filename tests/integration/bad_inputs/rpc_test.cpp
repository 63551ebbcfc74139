// Malformed, oversized and hostile gRPC calls against the real server.
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <thread>

#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/map.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "tests/integration/bad_inputs/table.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::rpc_test {
namespace {

using grpc::StatusCode;

const char* Name(StatusCode code) {
  switch (code) {
    case StatusCode::OK:
      return "OK";
    case StatusCode::INVALID_ARGUMENT:
      return "INVALID_ARGUMENT";
    case StatusCode::NOT_FOUND:
      return "NOT_FOUND";
    case StatusCode::PERMISSION_DENIED:
      return "PERMISSION_DENIED";
    case StatusCode::FAILED_PRECONDITION:
      return "FAILED_PRECONDITION";
    case StatusCode::RESOURCE_EXHAUSTED:
      return "RESOURCE_EXHAUSTED";
    case StatusCode::UNIMPLEMENTED:
      return "UNIMPLEMENTED";
    case StatusCode::INTERNAL:
      return "INTERNAL";
    case StatusCode::UNAVAILABLE:
      return "UNAVAILABLE";
    case StatusCode::DEADLINE_EXCEEDED:
      return "DEADLINE_EXCEEDED";
    case StatusCode::ABORTED:
      return "ABORTED";
    default:
      return "another code";
  }
}

std::string Text(const grpc::Status& status) {
  return std::string(Name(status.error_code())) +
         (status.error_message().empty() ? "" : ": " + status.error_message());
}

void Deadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
}

class BadRpc : public ::testing::Test {
 protected:
  BadRpc() {
    WriteSmallDataset(folder_ / "set", {.frames = 90});
    server_ = std::make_unique<Server>(std::vector<std::string>{
        "--source", "dataset:" + (folder_ / "set"), "--data-dir", folder_ / "data"});
    channel_ = grpc::CreateChannel(server_->grpc(), grpc::InsecureChannelCredentials());
    annotation_ = v1::AnnotationService::NewStub(channel_);
    session_ = v1::SessionService::NewStub(channel_);
    expert_ = Join(v1::ROLE_EXPERT);
  }
  ~BadRpc() override { EXPECT_TRUE(IsWell(*server_)) << server_->process().err(); }

  std::string Join(v1::Role role) {
    grpc::ClientContext context;
    Deadline(context);
    v1::JoinRequest request;
    request.set_role(role);
    v1::JoinResponse response;
    EXPECT_TRUE(session_->Join(&context, request, &response).ok());
    return response.session_id();
  }

  v1::CreateAnnotationRequest Good() const {
    v1::CreateAnnotationRequest request;
    request.set_session_id(expert_);
    request.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_CUBE);
    request.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_z(1);
    return request;
  }
  grpc::Status Create(const v1::CreateAnnotationRequest& request) {
    grpc::ClientContext context;
    Deadline(context);
    v1::CreateAnnotationResponse response;
    return annotation_->Create(&context, request, &response);
  }
  // Good() changed by `spoil` must be refused with `code`, naming `field`.
  template <typename Spoil>
  void Refuse(const std::string& input, StatusCode code, const std::string& field, Spoil spoil) {
    v1::CreateAnnotationRequest request = Good();
    spoil(request);
    const grpc::Status status = Create(request);
    Row("rpc", "Create: " + input, Text(status),
        status.error_code() == code && status.error_message().find(field) != std::string::npos);
  }
  static void SetPixel(v1::CreateAnnotationRequest& request, double u, double v) {
    v1::FramePixel& target = *request.mutable_draft()->mutable_target()->mutable_frame_pixel();
    target.mutable_pixel()->set_u(u);
    target.mutable_pixel()->set_v(v);
  }

  TemporaryFolder folder_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::AnnotationService::Stub> annotation_;
  std::unique_ptr<v1::SessionService::Stub> session_;
  std::string expert_;
};

TEST_F(BadRpc, ClicksThatAreNoPlaceAreRefusedByField) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  constexpr auto kInvalid = StatusCode::INVALID_ARGUMENT;
  Refuse("pixel NaN", kInvalid, "pixel.u", [&](auto& r) { SetPixel(r, nan, 5); });
  Refuse("pixel infinite", kInvalid, "pixel.v", [&](auto& r) { SetPixel(r, 5, -infinity); });
  Refuse("pixel left of the picture", kInvalid, "pixel.u", [&](auto& r) { SetPixel(r, -1, 5); });
  Refuse("pixel below the picture", kInvalid, "pixel.v", [&](auto& r) { SetPixel(r, 5, 240); });
  Refuse("frame that never was", StatusCode::NOT_FOUND, "frame", [&](auto& r) {
    SetPixel(r, 5, 5);
    r.mutable_draft()->mutable_target()->mutable_frame_pixel()->set_frame_id(1ull << 60);
  });
  Refuse("frame_pixel without a pixel", kInvalid, "pixel",
         [](auto& r) { r.mutable_draft()->mutable_target()->mutable_frame_pixel(); });
  Refuse("point NaN", kInvalid, "point_in_world_m.x", [&](auto& r) {
    r.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_x(nan);
  });
  Refuse("point a light year away", kInvalid, "point_in_world_m.z", [](auto& r) {
    r.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_z(9.5e15);
  });
  Refuse("feature that is not in the map", StatusCode::NOT_FOUND, "feature",
         [](auto& r) { r.mutable_draft()->mutable_target()->set_feature_id(987654321); });
  Refuse("ray without a direction", kInvalid, "direction_in_world",
         [](auto& r) { r.mutable_draft()->mutable_target()->mutable_ray(); });
  Refuse("no target", kInvalid, "target", [](auto& r) { r.mutable_draft()->clear_target(); });
}

TEST_F(BadRpc, DraftsOutOfBoundsAreRefusedByField) {
  constexpr auto kInvalid = StatusCode::INVALID_ARGUMENT;
  Refuse("no draft", kInvalid, "draft", [](auto& r) { r.clear_draft(); });
  Refuse("shape 99", kInvalid, "shape",
         [](auto& r) { r.mutable_draft()->set_shape(static_cast<v1::AnnotationShape>(99)); });
  Refuse("text of 501 bytes", kInvalid, "text",
         [](auto& r) { r.mutable_draft()->set_text(std::string(501, 'x')); });
  Refuse("text with control characters", kInvalid, "text",
         [](auto& r) { r.mutable_draft()->set_text("a\x1b[2Jb"); });
  Refuse("size NaN", kInvalid, "size_m",
         [](auto& r) { r.mutable_draft()->set_size_m(std::nan("")); });
  Refuse("size -1 m", kInvalid, "size_m", [](auto& r) { r.mutable_draft()->set_size_m(-1); });
  Refuse("size 11 m", kInvalid, "size_m", [](auto& r) { r.mutable_draft()->set_size_m(11); });
  Refuse("ink of one point", kInvalid, "ink_px", [](auto& r) {
    SetPixel(r, 5, 5);
    r.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_INK);
    r.mutable_draft()->add_ink_px();
  });
  const auto stroke = [](auto& r, int points) {
    SetPixel(r, 5, 5);
    r.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_INK);
    for (int i = 0; i < points; ++i) r.mutable_draft()->add_ink_px()->set_u(1);
  };
  Refuse("ink of 2001 points", kInvalid, "ink_px", [&](auto& r) { stroke(r, 2001); });
  Refuse("ink of 200000 points", StatusCode::RESOURCE_EXHAUSTED, "larger than max",
         [&](auto& r) { stroke(r, 200'000); });
}

TEST_F(BadRpc, WhoIsNotKnownOrNotAllowedIsRefused) {
  Refuse("session that is not a UUID", StatusCode::INVALID_ARGUMENT, "session_id",
         [](auto& r) { r.set_session_id("'; DROP TABLE annotations; --"); });
  Refuse("session unknown", StatusCode::NOT_FOUND, "session_id",
         [](auto& r) { r.set_session_id("6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11"); });
  Refuse("session of a viewer", StatusCode::PERMISSION_DENIED, "session_id",
         [&](auto& r) { r.set_session_id(Join(v1::ROLE_VIEWER)); });
  Refuse("request id that is not a UUID", StatusCode::INVALID_ARGUMENT, "request_id",
         [](auto& r) { r.set_request_id("1"); });

  const std::string unknown = "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";
  {
    grpc::ClientContext context;
    v1::DeleteAnnotationRequest request;
    request.set_session_id(expert_);
    request.set_id(unknown);
    v1::DeleteAnnotationResponse response;
    const grpc::Status status = annotation_->Delete(&context, request, &response);
    Row("rpc", "Delete: unknown id", Text(status), status.error_code() == StatusCode::NOT_FOUND);
  }
  {
    grpc::ClientContext context;
    v1::UpdateAnnotationRequest request;
    request.set_session_id(expert_);
    request.set_id(unknown);
    request.set_text("x");
    v1::UpdateAnnotationResponse response;
    const grpc::Status status = annotation_->Update(&context, request, &response);
    Row("rpc", "Update: unknown id", Text(status), status.error_code() == StatusCode::NOT_FOUND);
  }
  {
    grpc::ClientContext context;
    v1::UndoAnnotationRequest request;
    request.set_session_id(expert_);
    v1::UndoAnnotationResponse response;
    const grpc::Status status = annotation_->Undo(&context, request, &response);
    Row("rpc", "Undo: nothing done yet", Text(status),
        status.error_code() == StatusCode::FAILED_PRECONDITION ||
            status.error_code() == StatusCode::NOT_FOUND);
  }
  for (const bool viewer : {true, false}) {
    grpc::ClientContext context;
    v1::ResetMapRequest request;
    if (viewer) request.set_session_id(Join(v1::ROLE_VIEWER));
    v1::ResetMapResponse response;
    const grpc::Status status =
        v1::MapService::NewStub(channel_)->Reset(&context, request, &response);
    Row("rpc", viewer ? "Map.Reset by a viewer" : "Map.Reset without a session", Text(status),
        status.error_code() ==
            (viewer ? StatusCode::PERMISSION_DENIED : StatusCode::INVALID_ARGUMENT));
  }
}

TEST_F(BadRpc, SameRequestTwiceCreatesOnce) {
  v1::CreateAnnotationRequest request = Good();
  request.set_request_id("0e4a7f6a-52a1-4a55-8f0f-111111111111");
  std::string ids[2];
  for (std::string& id : ids) {
    grpc::ClientContext context;
    v1::CreateAnnotationResponse response;
    ASSERT_TRUE(annotation_->Create(&context, request, &response).ok());
    id = response.annotation().id();
  }
  Row("rpc", "Create: the same request id twice", ids[0] == ids[1] ? "the first result" : "two",
      ids[0] == ids[1] && !ids[0].empty());
}

// Bytes that are no message, straight to a method.
grpc::Status SendBytes(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                       const std::string& bytes) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  Deadline(context);
  grpc::CompletionQueue queue;
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::Status status;
  const auto call = stub.PrepareUnaryCall(&context, method, request, &queue);
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

TEST_F(BadRpc, BytesThatAreNoMessageAreRefused) {
  const std::string create = "/saccade.v1.AnnotationService/Create";
  std::string rubbish;
  for (int i = 0; i < 4096; ++i) rubbish += static_cast<char>((i * 7919 + 13) >> 3);
  const grpc::Status garbled = SendBytes(channel_, create, rubbish);
  Row("rpc", "4 KiB of rubbish as a message", Text(garbled), !garbled.ok());
  // A length-delimited field that claims 2 GiB and ends at once.
  const grpc::Status cut = SendBytes(channel_, create, std::string("\x1a\xff\xff\xff\xff\x07", 6));
  Row("rpc", "message cut short, claiming 2 GiB", Text(cut), !cut.ok());
  const grpc::Status utf8 = SendBytes(channel_, create, std::string("\x12\x04\xff\xfe\xfd\xfc", 6));
  Row("rpc", "session id that is not UTF-8", Text(utf8), !utf8.ok());
  std::string nested;  // groups within groups: what recursion limits are for
  for (int i = 0; i < 5000; ++i) nested += '\x0b';
  const grpc::Status deep = SendBytes(channel_, create, nested);
  Row("rpc", "5000 nested groups", Text(deep), !deep.ok());
  const grpc::Status unknown = SendBytes(channel_, "/saccade.v1.AnnotationService/Explode", "");
  Row("rpc", "method that does not exist", Text(unknown),
      unknown.error_code() == StatusCode::UNIMPLEMENTED);
}

TEST_F(BadRpc, OversizedMessageIsRefused) {
  const grpc::Status status =
      SendBytes(channel_, "/saccade.v1.AnnotationService/Create",
                std::string("\x12\x80\x80\x80\x20", 5) + std::string(64 << 20, 'x'));
  Row("rpc", "message of 64 MiB", Text(status),
      status.error_code() == StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(BadRpc, FloodIsAnsweredToTheLastCall) {
  constexpr int kThreads = 8, kEach = 100;
  std::atomic<int> ok = 0, refused = 0, other = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < kEach; ++i) {
        const grpc::Status status = Create(Good());
        if (status.ok()) {
          ++ok;
        } else if (status.error_code() == StatusCode::RESOURCE_EXHAUSTED) {
          ++refused;
        } else {
          ++other;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  Row("rpc", "800 creations at once from 8 clients",
      std::to_string(ok) + " OK, " + std::to_string(refused) + " RESOURCE_EXHAUSTED, " +
          std::to_string(other) + " other",
      ok + refused == kThreads * kEach && ok > 0);
}

TEST_F(BadRpc, SubscriptionsOutOfBoundsAreRefused) {
  const auto subscribe = [&](const v1::SubscribeRequest& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
    const auto reader = session_->Subscribe(&context, request);
    v1::Event event;
    if (reader->Read(&event)) context.TryCancel();
    return reader->Finish();
  };
  v1::SubscribeRequest request;
  request.set_session_id(expert_);
  request.set_window(1'000'000);
  grpc::Status status = subscribe(request);
  Row("rpc", "Subscribe: window of a million", Text(status),
      status.error_code() == StatusCode::INVALID_ARGUMENT);
  request.set_window(0);
  request.add_topics(static_cast<v1::Topic>(77));
  status = subscribe(request);
  Row("rpc", "Subscribe: topic 77", Text(status),
      status.error_code() == StatusCode::INVALID_ARGUMENT);

  grpc::ClientContext context;
  v1::AcknowledgeRequest acknowledge;
  acknowledge.set_session_id(Join(v1::ROLE_EXPERT));
  acknowledge.set_sequence(~0ull);
  v1::AcknowledgeResponse response;
  status = session_->Acknowledge(&context, acknowledge, &response);
  Row("rpc", "Acknowledge without a stream", Text(status), !status.ok());
}

}  // namespace
}  // namespace saccade::testing::rpc_test
