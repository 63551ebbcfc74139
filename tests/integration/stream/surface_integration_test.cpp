// Surfaces over real gRPC sockets, server in process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "saccade/v1/surface.grpc.pb.h"
#include "shared/wire/surface.hpp"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"

namespace saccade::surface_integration_test {
namespace {

using ::testing::HasSubstr;
using testing::InProcessOptions;
using testing::InProcessServer;
using testing::TestClient;

constexpr double kTexture_m = 2.0;  // as the server's camera has it

class SurfaceCalls : public ::testing::Test {
 protected:
  void SetUp() override {
    SurfaceRunnerOptions runner;
    runner.most_cores = 1.0;
    auto surfaces = SurfaceRunner::Create(runner);
    ASSERT_TRUE(surfaces.ok()) << surfaces.status();
    InProcessOptions options;
    options.moves_aside = true;
    options.surfaces = *std::move(surfaces);
    server_ = std::make_unique<InProcessServer>(options);
    client_ = std::make_unique<TestClient>(server_->address());
    stub_ = v1::SurfaceService::NewStub(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  grpc::Status Get(v1::GetSurfaceRequest request, v1::GetSurfaceResponse& response) {
    grpc::ClientContext context;
    request.set_session_id(client_->session_id());
    response.Clear();
    return stub_->Get(&context, request, &response);
  }

  /// Everything newer than `from`, page by page of at most `max_bytes`.
  std::vector<v1::SurfaceChunk> GetAll(v1::GetSurfaceResponse& from, std::uint32_t max_bytes) {
    std::vector<v1::SurfaceChunk> chunks;
    do {
      v1::GetSurfaceRequest request;
      request.set_edition(from.edition());
      request.set_version(from.version());
      request.set_max_bytes(max_bytes);
      const grpc::Status status = Get(request, from);
      EXPECT_TRUE(status.ok()) << status.error_message();
      EXPECT_TRUE(from.chunks_size() <= 1 || from.ByteSizeLong() < max_bytes + 200);
      chunks.insert(chunks.end(), from.chunks().begin(), from.chunks().end());
    } while (from.more());
    return chunks;
  }

  bool WaitForSurface() {
    return client_->WaitFor(
        [](const auto& events) {
          return std::any_of(events.begin(), events.end(),
                             [](const auto& each) { return each.event.surface().version() > 20; });
        },
        std::chrono::seconds(40));
  }

  std::unique_ptr<InProcessServer> server_;
  std::unique_ptr<TestClient> client_;
  std::unique_ptr<v1::SurfaceService::Stub> stub_;
};

TEST_F(SurfaceCalls, WhatTheCameraPassedByIsFetchedByVersionAndClickedOn) {
  v1::SubscribeRequest subscribe;
  subscribe.add_topics(v1::TOPIC_SURFACE);
  client_->Subscribe(subscribe);
  ASSERT_TRUE(WaitForSurface());

  v1::GetSurfaceResponse all;
  const std::vector<v1::SurfaceChunk> chunks = GetAll(all, 8'192);
  ASSERT_FALSE(chunks.empty());
  std::vector<double> off;
  for (const v1::SurfaceChunk& coded : chunks) {
    const auto chunk = wire::FromProto(coded);
    ASSERT_TRUE(chunk.ok()) << chunk.status();
    for (std::size_t i = 0; i < chunk->positions.size(); ++i) {
      off.push_back(std::abs(chunk->Point(i).z() - kTexture_m) / kTexture_m);
    }
  }
  ASSERT_GT(off.size(), 500u);
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 0.01);
  EXPECT_LT(off[off.size() * 9 / 10], 0.03);

  // Only what is newer; and all of it to whoever has that of another server.
  v1::GetSurfaceResponse later = all;
  GetAll(later, 524'288);
  EXPECT_EQ(later.edition(), all.edition());
  EXPECT_GE(later.version(), all.version());
  v1::GetSurfaceResponse stranger = all;
  stranger.set_edition(all.edition() + 1);
  EXPECT_GE(GetAll(stranger, 524'288).size(), chunks.size() / 2);
  EXPECT_EQ(stranger.edition(), all.edition());
  v1::GetSurfaceResponse ahead = all;
  ahead.set_version(all.version() + 1'000'000);
  EXPECT_FALSE(GetAll(ahead, 524'288).empty());

  // What is in the middle of the picture may be seen a little later.
  v1::CreateAnnotationResponse created;
  for (int k = 10; k < 60; ++k) {
    const grpc::Status placed =
        client_->Create(client_->CubeAt(160, 120, client_->NewestFrame()),
                        "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d" + std::to_string(k), created);
    ASSERT_TRUE(placed.ok()) << placed.error_message();
    if (created.annotation().anchor().method() == v1::ANCHOR_METHOD_SCENE) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  EXPECT_EQ(created.annotation().anchor().method(), v1::ANCHOR_METHOD_SCENE);
  EXPECT_NEAR(created.annotation().anchor().point_in_world_m().z(), kTexture_m, 0.04);
}

TEST_F(SurfaceCalls, WhatTheWearerPausedIsInNoSurface) {
  std::atomic<bool> paused = false;
  server_->engine().PausePicture(true, "wearer",
                                 [&](const absl::StatusOr<PicturePause>&) { paused = true; });
  std::this_thread::sleep_for(std::chrono::seconds(3));
  EXPECT_TRUE(paused);
  v1::GetSurfaceResponse all;
  EXPECT_TRUE(GetAll(all, 0).empty());
}

TEST_F(SurfaceCalls, WhatIsAskedWrongIsNamed) {
  v1::GetSurfaceRequest request;
  request.set_max_bytes(100);
  v1::GetSurfaceResponse response;
  const grpc::Status status = Get(request, response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("max_bytes"));
  grpc::ClientContext context;
  request.set_session_id("6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11");
  EXPECT_FALSE(stub_->Get(&context, request, &response).ok());
}

TEST(NoSurfaces, TheServerThatMakesNoneSaysSo) {
  InProcessServer server;
  TestClient client(server.address());
  const auto stub = v1::SurfaceService::NewStub(
      grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::GetSurfaceRequest request;
  request.set_session_id(client.session_id());
  v1::GetSurfaceResponse response;
  ASSERT_TRUE(stub->Get(&context, request, &response).ok());
  EXPECT_EQ(response.edition(), 0u);
}

}  // namespace
}  // namespace saccade::surface_integration_test
