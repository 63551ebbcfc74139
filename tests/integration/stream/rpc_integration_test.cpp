// Unary calls over real gRPC sockets, good and bad, server in process.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::rpc_integration_test {
namespace {

using ::testing::HasSubstr;
using testing::InProcessServer;
using ::testing::StartsWith;
using testing::TestClient;

constexpr char kUnknownId[] = "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";

std::string Uuid(int n) {
  char text[40];
  std::snprintf(text, sizeof text, "00000000-0000-4000-8000-%012d", n);
  return text;
}

// Waits for a frame that can be clicked.
std::uint64_t FirstFrame(TestClient& client) {
  std::uint64_t frame = 0;
  for (int i = 0; i < 100 && frame == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    frame = client.NewestFrame();
  }
  return frame;
}

TEST(Rpc, AClickBecomesAnAnchorWhereTheMapSays) {
  InProcessServer server;
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  v1::CreateAnnotationResponse response;
  const grpc::Status status = client.Create(client.CubeAt(170, 130, frame), Uuid(1), response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NEAR(response.annotation().anchor().point_in_world_m().z(), 2.0, 0.05);
  EXPECT_EQ(response.annotation().author(), "tester");
}

TEST(Rpc, ARepeatedRequestIdAnswersWithTheFirstResult) {
  InProcessServer server;
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  v1::CreateAnnotationResponse first, again, other;
  ASSERT_TRUE(client.Create(client.CubeAt(170, 130, frame), Uuid(1), first).ok());
  ASSERT_TRUE(client.Create(client.CubeAt(100, 100, frame), Uuid(1), again).ok());
  ASSERT_TRUE(client.Create(client.CubeAt(100, 100, frame), Uuid(2), other).ok());
  EXPECT_EQ(first.annotation().id(), again.annotation().id());
  EXPECT_NE(first.annotation().id(), other.annotation().id());
  grpc::ClientContext context;
  v1::ListAnnotationsResponse list;
  ASSERT_TRUE(client.annotations().List(&context, {}, &list).ok());
  EXPECT_EQ(list.annotations_size(), 2);
}

TEST(Rpc, WhatWasAnsweredIsBackAfterARestart) {
  testing::TemporaryFolder folder;
  testing::InProcessOptions options;
  options.data_dir = folder.path();
  std::string id;
  {
    InProcessServer server(options);
    TestClient client(server.address());
    v1::CreateAnnotationResponse response;
    ASSERT_TRUE(client.Create(client.CubeAt(170, 130, FirstFrame(client)), "", response).ok());
    id = response.annotation().id();
  }
  InProcessServer server(options);
  TestClient client(server.address());
  grpc::ClientContext context;
  v1::ListAnnotationsResponse list;
  ASSERT_TRUE(client.annotations().List(&context, {}, &list).ok());
  ASSERT_EQ(list.annotations_size(), 1);
  EXPECT_EQ(list.annotations(0).id(), id);
}

TEST(Rpc, EditsReachTheOthersAndCanBeTakenBack) {
  InProcessServer server;
  TestClient author(server.address()), other(server.address());
  v1::SubscribeRequest topics;
  topics.add_topics(v1::TOPIC_ANNOTATION);
  other.Subscribe(topics);
  v1::CreateAnnotationResponse created;
  ASSERT_TRUE(author.Create(author.CubeAt(170, 130, FirstFrame(author)), "", created).ok());
  const std::string id = created.annotation().id();
  const auto upserted = [&id](const auto& events) {
    for (const auto& one : events) {
      for (const auto& annotation : one.event.annotation().upserted()) {
        if (annotation.id() == id) return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(other.WaitFor(upserted));
  {
    grpc::ClientContext context;
    v1::UpdateAnnotationRequest request;
    request.set_session_id(author.session_id());
    request.set_id(id);
    request.set_text("oil");
    v1::UpdateAnnotationResponse response;
    ASSERT_TRUE(author.annotations().Update(&context, request, &response).ok());
    EXPECT_EQ(response.annotation().text(), "oil");
    EXPECT_GT(response.annotation().revision(), created.annotation().revision());
  }
  {
    grpc::ClientContext context;
    v1::UndoAnnotationRequest request;
    request.set_session_id(other.session_id());
    v1::UndoAnnotationResponse response;
    EXPECT_EQ(other.annotations().Undo(&context, request, &response).error_code(),
              grpc::StatusCode::FAILED_PRECONDITION)
        << "undo takes back one's own changes only";
  }
  {
    grpc::ClientContext context;
    v1::DeleteAnnotationRequest request;
    request.set_session_id(author.session_id());
    request.set_id(id);
    v1::DeleteAnnotationResponse response;
    ASSERT_TRUE(author.annotations().Delete(&context, request, &response).ok());
  }
  EXPECT_TRUE(other.WaitFor([&id](const auto& events) {
    for (const auto& one : events) {
      for (const std::string& removed : one.event.annotation().removed_ids()) {
        if (removed == id) return true;
      }
    }
    return false;
  }));
}

TEST(Rpc, BadClicksNameTheField) {
  InProcessServer server;
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  v1::CreateAnnotationResponse response;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  grpc::Status status = client.Create(client.CubeAt(nan, 3, frame), "", response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), StartsWith("draft.target.frame_pixel.pixel.u: "));
  EXPECT_THAT(status.error_details(), HasSubstr("google.rpc.BadRequest"));
  status = client.Create(client.CubeAt(5, 4000, frame), "", response);
  EXPECT_THAT(status.error_message(), StartsWith("draft.target.frame_pixel.pixel.v: 4000"));
  status = client.Create(client.CubeAt(5, 5, frame), "not a uuid", response);
  EXPECT_THAT(status.error_message(), StartsWith("request_id: "));
  v1::AnnotationDraft draft = client.CubeAt(5, 5, frame);
  draft.set_text(std::string(501, 'x'));
  EXPECT_THAT(client.Create(draft, "", response).error_message(), StartsWith("draft.text: "));
  draft.clear_text();
  draft.set_size_m(-1);
  EXPECT_THAT(client.Create(draft, "", response).error_message(), StartsWith("draft.size_m: "));
  draft.clear_target();
  draft.clear_size_m();
  EXPECT_THAT(client.Create(draft, "", response).error_message(), StartsWith("draft.target: "));
}

TEST(Rpc, UnknownThingsAreNotFound) {
  InProcessServer server;
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  v1::CreateAnnotationResponse response;
  EXPECT_EQ(client.Create(client.CubeAt(5, 5, frame + 100'000), "", response).error_code(),
            grpc::StatusCode::NOT_FOUND);
  v1::AnnotationDraft draft = client.CubeAt(5, 5, frame);
  draft.mutable_target()->set_feature_id(999'999);
  EXPECT_EQ(client.Create(draft, "", response).error_code(), grpc::StatusCode::NOT_FOUND);
  {
    grpc::ClientContext context;
    v1::DeleteAnnotationRequest request;
    request.set_session_id(client.session_id());
    request.set_id(kUnknownId);
    v1::DeleteAnnotationResponse deleted;
    EXPECT_EQ(client.annotations().Delete(&context, request, &deleted).error_code(),
              grpc::StatusCode::NOT_FOUND);
  }
  {
    grpc::ClientContext context;
    v1::AcknowledgeRequest request;
    request.set_session_id(kUnknownId);
    v1::AcknowledgeResponse acknowledged;
    EXPECT_EQ(client.session().Acknowledge(&context, request, &acknowledged).error_code(),
              grpc::StatusCode::NOT_FOUND);
  }
  {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_frame_id(frame + 100'000);
    v1::GetFrameResponse still;
    EXPECT_EQ(client.session().GetFrame(&context, request, &still).error_code(),
              grpc::StatusCode::NOT_FOUND);
  }
  grpc::ClientContext context;
  v1::SubscribeRequest request;
  request.set_session_id(kUnknownId);
  const auto reader = client.session().Subscribe(&context, request);
  v1::Event event;
  EXPECT_FALSE(reader->Read(&event));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST(Rpc, AViewerChangesNothing) {
  InProcessServer server;
  TestClient viewer(server.address(), v1::ROLE_VIEWER);
  v1::CreateAnnotationResponse response;
  EXPECT_EQ(viewer.Create(viewer.CubeAt(5, 5, FirstFrame(viewer)), "", response).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Rpc, AStillIsTheFrameAskedForWithItsPose) {
  InProcessServer server;
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  for (const v1::VideoView view : {v1::VIDEO_VIEW_RAW, v1::VIDEO_VIEW_AUGMENTED}) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_frame_id(frame);
    request.set_view(view);
    v1::GetFrameResponse response;
    ASSERT_TRUE(client.session().GetFrame(&context, request, &response).ok());
    EXPECT_EQ(response.frame_id(), frame);
    EXPECT_EQ(response.pose().frame_id(), frame);
    const std::vector<uchar> png(response.png().begin(), response.png().end());
    EXPECT_EQ(cv::imdecode(png, cv::IMREAD_UNCHANGED).size(), cv::Size(320, 240));
  }
}

TEST(Rpc, PingGivesTheClockOffset) {
  InProcessServer server;
  TestClient client(server.address());
  grpc::ClientContext context;
  v1::PingRequest request;
  request.set_client_send_ns(MonotonicNow());
  v1::PingResponse response;
  ASSERT_TRUE(client.session().Ping(&context, request, &response).ok());
  EXPECT_EQ(response.client_send_ns(), request.client_send_ns());
  // The same machine: the same clock.
  EXPECT_GE(response.server_receive_ns(), request.client_send_ns());
  EXPECT_GE(response.server_send_ns(), response.server_receive_ns());
  EXPECT_GE(MonotonicNow(), response.server_send_ns());
}

TEST(Rpc, TheMapIsExportedAndReset) {
  InProcessServer server;
  TestClient client(server.address());
  FirstFrame(client);
  {
    grpc::ClientContext context;
    v1::ExportMapResponse response;
    ASSERT_TRUE(client.map().Export(&context, {}, &response).ok());
    EXPECT_EQ(response.feature_count(), 20u);
    EXPECT_THAT(response.data(), StartsWith("ply\nformat ascii 1.0\n"));
    EXPECT_THAT(response.data(), HasSubstr("element vertex 20\n"));
  }
  {
    grpc::ClientContext context;
    v1::ResetMapRequest request;
    request.set_session_id(client.session_id());
    v1::ResetMapResponse response;
    ASSERT_TRUE(client.map().Reset(&context, request, &response).ok());
    EXPECT_EQ(response.map_generation(), 1u);
  }
  grpc::ClientContext context;
  v1::SaveMapResponse saved;
  EXPECT_EQ(client.map().Save(&context, {}, &saved).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION)
      << "this server keeps none";
}

TEST(Rpc, WhoMayNotEditMayNotResetTheMap) {
  InProcessServer server;
  TestClient viewer(server.address(), v1::ROLE_VIEWER);
  TestClient wearer(server.address(), v1::ROLE_WEARER);
  FirstFrame(wearer);
  const auto reset = [&](const std::string& session_id, v1::ResetMapResponse& response) {
    grpc::ClientContext context;
    v1::ResetMapRequest request;
    request.set_session_id(session_id);
    return wearer.map().Reset(&context, request, &response);
  };
  v1::ResetMapResponse response;
  EXPECT_EQ(reset(viewer.session_id(), response).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  const grpc::Status without = reset("", response);
  EXPECT_EQ(without.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(without.error_message(), StartsWith("session_id"));
  EXPECT_EQ(reset(Uuid(7), response).error_code(), grpc::StatusCode::NOT_FOUND);
  ASSERT_TRUE(reset(wearer.session_id(), response).ok());
  EXPECT_EQ(response.map_generation(), 1u) << "none of the refused ones did it";
}

TEST(Rpc, TheHistoryOfASessionGoesWithIt) {
  testing::InProcessOptions options;
  options.sessions = {.max_sessions = 2, .idle_ns = 0};
  InProcessServer server(options);
  TestClient client(server.address());
  v1::CreateAnnotationResponse created;
  ASSERT_TRUE(client.Create(client.CubeAt(100, 100, FirstFrame(client)), Uuid(1), created).ok());
  TestClient second(server.address()), third(server.address());  // the table holds two
  // Past the services, which refuse the session's id by now: is anything still kept for it?
  std::promise<absl::StatusOr<std::string>> undone;
  ASSERT_TRUE(server.engine()
                  .Submit(UndoChange{client.session_id(), false,
                                     [&undone](absl::StatusOr<std::string> answer) {
                                       undone.set_value(std::move(answer));
                                     }})
                  .ok());
  EXPECT_EQ(undone.get_future().get().status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(Rpc, AFullMailboxRefuses) {
  std::promise<void> open;
  const std::shared_future<void> gate = open.get_future().share();
  std::atomic<bool> close = false;
  testing::InProcessOptions options;
  options.mailbox = 8;
  options.before_frame = [&] {
    if (close) gate.wait();
  };
  InProcessServer server(options);
  TestClient client(server.address());
  const std::uint64_t frame = FirstFrame(client);
  close = true;
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the tracker thread now waits
  std::vector<std::future<grpc::StatusCode>> calls;
  for (int i = 0; i < 20; ++i) {
    calls.push_back(std::async(std::launch::async, [&client, frame, i] {
      v1::CreateAnnotationResponse response;
      return client.Create(client.CubeAt(100 + i, 100, frame), Uuid(i), response).error_code();
    }));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  // Nothing else suffers meanwhile.
  grpc::ClientContext context;
  v1::PingResponse pong;
  EXPECT_TRUE(client.session().Ping(&context, {}, &pong).ok());
  open.set_value();
  int done = 0, refused = 0;
  for (auto& call : calls) {
    const grpc::StatusCode code = call.get();
    done += code == grpc::StatusCode::OK ? 1 : 0;
    refused += code == grpc::StatusCode::RESOURCE_EXHAUSTED ? 1 : 0;
  }
  EXPECT_EQ(done, 8);
  EXPECT_EQ(refused, 12);
}

grpc::Status CallRaw(const std::string& address, const std::string& method,
                     const std::string& bytes) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
  std::promise<grpc::Status> done;
  stub.UnaryCall(&context, method, {}, &request, &response,
                 [&done](grpc::Status status) { done.set_value(std::move(status)); });
  return done.get_future().get();
}

TEST(Rpc, MalformedAndOversizedRequestsAreRefusedAndTheServerLives) {
  InProcessServer server;
  TestClient client(server.address());
  const std::string create = "/saccade.v1.AnnotationService/Create";
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    std::string bytes(1 + random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    EXPECT_FALSE(CallRaw(server.address(), create, bytes).ok());
  }
  // A draft may hold a picture of a mebibyte; nothing else is half as long.
  EXPECT_EQ(CallRaw(server.address(), create, std::string(2 << 20, 'x')).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(
      CallRaw(server.address(), "/saccade.v1.AnnotationService/Update", std::string(512 << 10, 'x'))
          .error_code(),
      grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(CallRaw(server.address(), "/saccade.v1.AnnotationService/Nonsense", "").error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_TRUE(CallRaw(server.address(), "/saccade.v1.SessionService/Ping", "").ok());
  EXPECT_TRUE(CallRaw(server.address(), "/grpc.health.v1.Health/Check", "").ok());
}

}  // namespace
}  // namespace saccade::rpc_integration_test
