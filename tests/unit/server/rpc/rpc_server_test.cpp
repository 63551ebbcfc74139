// The gRPC server with real sockets before a backend that only keeps a list: what strangers do to
// it.
#include "server/rpc/rpc_server.hpp"

#include <absl/strings/str_format.h>
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <functional>
#include <mutex>
#include <thread>

#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"

namespace saccade::rpc_server_test {
namespace {

using std::chrono::milliseconds;

/// Keeps annotations and replaces their list with each edit, as the engine does.
class ListBackend final : public Backend {
 public:
  ListBackend() {
    CameraIntrinsics intrinsics;
    intrinsics.width = 640;
    intrinsics.height = 480;
    intrinsics.fx = intrinsics.fy = 500;
    facts_.camera = std::make_shared<CameraModel>(intrinsics);
  }
  std::shared_ptr<const Scene> scene() const override { return std::make_shared<const Scene>(); }
  absl::Status SubmitScene(SceneCommand /*command*/) override {
    return absl::UnavailableError("no scene");
  }
  const ServerFacts& facts() const override { return facts_; }
  std::shared_ptr<const AnnotationList> annotations() const override {
    const std::lock_guard lock(mutex_);
    return list_;
  }
  std::shared_ptr<const GazeSnapshot> gaze() const override {
    return std::make_shared<const GazeSnapshot>();
  }
  absl::Status SubmitGaze(GazeCommand) override { return absl::FailedPreconditionError("none"); }
  void GetStill(std::optional<FrameId>, VideoView, Done<Still> done) override {
    done(absl::NotFoundError("none"));
  }
  absl::StatusOr<std::vector<Eigen::Vector3d>> LocatePointer(
      absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>*) override {
    return std::vector<Eigen::Vector3d>(points.size(), Eigen::Vector3d::UnitZ());
  }
  void SetPointers(std::shared_ptr<const PointerList>) override {}
  void ReadPicture(std::string, Done<PicturePtr> done) override {
    done(absl::UnimplementedError("not here"));
  }
  void SetPresence(std::shared_ptr<const ParticipantSet>) override {}
  void SetVideoDemand(VideoView, bool) override {}
  void RequestKeyFrame(VideoView) override {}
  void PausePicture(bool, std::string, Done<PicturePause> done) override { done(PicturePause()); }
  std::shared_ptr<const PicturePause> picture_pause() const override {
    return std::make_shared<const PicturePause>();
  }

  absl::Status Submit(Command command) override {
    if (auto* create = std::get_if<CreateAnnotation>(&command)) {
      Annotation made;
      made.text = create->draft.text;
      Change([&](AnnotationList& list) {
        made.id = absl::StrFormat("00000000-0000-4000-8000-%012d", ++made_);
        list.push_back(made);
      });
      create->done(made);
    } else if (auto* remove = std::get_if<DeleteAnnotation>(&command)) {
      Change([&](AnnotationList& list) {
        std::erase_if(list, [&](const Annotation& one) { return one.id == remove->id; });
      });
      remove->done(absl::OkStatus());
    } else {
      Fail(command, absl::UnimplementedError("not here"));
    }
    return absl::OkStatus();
  }

 private:
  void Change(const std::function<void(AnnotationList&)>& change) {
    const std::lock_guard lock(mutex_);
    auto next = std::make_shared<AnnotationList>(*list_);
    change(*next);
    list_ = std::move(next);
  }

  ServerFacts facts_;
  mutable std::mutex mutex_;
  std::shared_ptr<const AnnotationList> list_ = std::make_shared<const AnnotationList>();
  int made_ = 0;
};

class RpcServerTest : public ::testing::Test {
 protected:
  void Start(RpcServerOptions options = {}) {
    options.port = 0;
    hub_.Connect(&backend_);
    auto started = RpcServer::Start(options, backend_, hub_);
    ASSERT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
  }
  std::shared_ptr<grpc::Channel> Channel() const {
    grpc::ChannelArguments own;  // not shared with the others
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(server_->port()),
                                     grpc::InsecureChannelCredentials(), own);
  }
  grpc::Status Join(v1::JoinResponse& response) const {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
    return v1::SessionService::NewStub(Channel())->Join(&context, {}, &response);
  }

  ListBackend backend_;
  StreamHub hub_{/*silence_ns=*/300'000'000};
  std::unique_ptr<RpcServer> server_;
};

/// CPU time of this process for each call [us], client included, of requests as large as may be.
double CpuOf(const std::shared_ptr<grpc::Channel>& channel, int calls, grpc::StatusCode expected) {
  v1::CreateAnnotationRequest request;
  request.set_session_id("nobody's");
  for (int i = 0; i < 8000; ++i) {
    v1::Pixel& point = *request.mutable_draft()->add_ink_px();
    point.set_u(1 + i);
    point.set_v(2 + i);
  }
  const auto stub = v1::AnnotationService::NewStub(channel);
  const auto now_us = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1e6 * static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  };
  const double before_us = now_us();
  for (int i = 0; i < calls; ++i) {
    grpc::ClientContext context;
    v1::CreateAnnotationResponse response;
    EXPECT_EQ(stub->Create(&context, request, &response).error_code(), expected);
  }
  return (now_us() - before_us) / calls;
}

// What is served here is refused as well, but for what it says: a lower bound.
TEST_F(RpcServerTest, AnEarlyRefusalCostsLessThanServing) {
  RpcServerOptions options;
  options.limits = RpcLimits().Scaled(0);
  Start(options);
  const double served_us = CpuOf(Channel(), 400, grpc::StatusCode::INVALID_ARGUMENT);
  options.traffic.this_machine = true;
  options.traffic.address_requests = {1e-6, 1};
  options.port = 0;
  auto strict = RpcServer::Start(options, backend_, hub_);
  ASSERT_TRUE(strict.ok()) << strict.status();
  server_ = *std::move(strict);
  v1::JoinResponse taken;
  EXPECT_TRUE(Join(taken).ok()) << "the only one";
  const double refused_us = CpuOf(Channel(), 400, grpc::StatusCode::RESOURCE_EXHAUSTED);
  std::printf("CPU a call: served %.0f us, refused %.0f us (%.2f)\n", served_us, refused_us,
              refused_us / served_us);
  EXPECT_LT(refused_us, 0.9 * served_us);
}

// List used to iterate over a list that nobody held any more: a crash within a second.
TEST_F(RpcServerTest, ListHoldsWhatItReadsWhileOthersEdit) {
  RpcServerOptions options;
  options.limits = RpcLimits().Scaled(0);
  Start(options);
  const std::shared_ptr<grpc::Channel> channel = Channel();
  v1::JoinResponse joined;
  ASSERT_TRUE(Join(joined).ok());
  std::atomic<bool> stop = false;
  std::atomic<int> lists = 0, edits = 0;
  const auto list = [&] {
    const auto stub = v1::AnnotationService::NewStub(channel);
    while (!stop) {
      grpc::ClientContext context;
      v1::ListAnnotationsResponse response;
      ASSERT_TRUE(stub->List(&context, {}, &response).ok());
      ++lists;
    }
  };
  const auto edit = [&] {
    const auto stub = v1::AnnotationService::NewStub(channel);
    v1::CreateAnnotationRequest create;
    create.set_session_id(joined.session_id());
    create.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_NOTE);
    create.mutable_draft()->set_text(std::string(300, 'x'));
    create.mutable_draft()->mutable_target()->set_feature_id(1);
    std::vector<std::string> mine;
    while (!stop) {
      grpc::ClientContext context;
      if (mine.size() < 20) {
        v1::CreateAnnotationResponse response;
        const grpc::Status status = stub->Create(&context, create, &response);
        ASSERT_TRUE(status.ok()) << status.error_message();
        mine.push_back(response.annotation().id());
      } else {
        v1::DeleteAnnotationRequest request;
        request.set_session_id(joined.session_id());
        request.set_id(mine.back());
        mine.pop_back();
        v1::DeleteAnnotationResponse response;
        ASSERT_TRUE(stub->Delete(&context, request, &response).ok());
        if (mine.size() == 10) mine.resize(0);
      }
      ++edits;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back(list);
    for (int i = 0; i < 4; ++i) threads.emplace_back(edit);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    stop = true;
  }
  EXPECT_GT(lists, 20);
  EXPECT_GT(edits, 20);
}

TEST_F(RpcServerTest, RefusalsForComingTooOftenSayWhenToTryAgain) {
  RpcServerOptions options;
  options.limits.join = {{}, {}, {.per_s = 0.5, .burst = 2}, {}};
  Start(options);
  v1::JoinResponse joined;
  EXPECT_TRUE(Join(joined).ok());
  EXPECT_TRUE(Join(joined).ok());
  const grpc::Status refused = Join(joined);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), ::testing::HasSubstr("too many joins from this address"));
  EXPECT_THAT(refused.error_details(), ::testing::HasSubstr("google.rpc.RetryInfo"));
}

int ConnectTo(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  if (fd < 0) return -1;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) return fd;
  ::close(fd);
  return -1;
}

// gRPC's own listener closes its port for good when accept fails once.
TEST_F(RpcServerTest, ThePortIsThereAgainAfterDescriptorsRanOut) {
  Start();
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit little = before;
  little.rlim_cur = 160;  // of this process, which is client and server
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &little), 0);
  std::vector<int> idle;
  for (int i = 0; i < 400; ++i) {
    const int fd = ConnectTo(server_->port());
    if (fd < 0) break;
    idle.push_back(fd);
  }
  std::this_thread::sleep_for(milliseconds(300));
  const bool ran_out = ::dup(0) < 0;
  for (const int fd : idle) ::close(fd);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_TRUE(ran_out);
  v1::JoinResponse joined;
  grpc::Status status;
  for (int i = 0; i < 20 && !(status = Join(joined)).ok(); ++i) {
    std::this_thread::sleep_for(milliseconds(100));
  }
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(RpcServerTest, AStreamThatNobodyAcknowledgesEnds) {
  Start();
  v1::JoinResponse joined;
  ASSERT_TRUE(Join(joined).ok());
  grpc::ClientContext context;
  v1::SubscribeRequest request;
  request.set_session_id(joined.session_id());
  const auto stub = v1::SessionService::NewStub(Channel());
  const auto stream = stub->Subscribe(&context, request);
  v1::Event event;
  ASSERT_TRUE(stream->Read(&event)) << "presence, at least";
  EXPECT_EQ(hub_.presence()->participants_size(), 1);
  std::jthread clock([this](std::stop_token stop) {
    while (!stop.stop_requested()) {
      hub_.OnStatistics({});
      std::this_thread::sleep_for(milliseconds(50));
    }
  });
  while (stream->Read(&event)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(hub_.presence()->participants_size(), 0);
}

TEST_F(RpcServerTest, AStreamThatIsAcknowledgedGoesOn) {
  Start();
  v1::JoinResponse joined;
  ASSERT_TRUE(Join(joined).ok());
  const auto stub = v1::SessionService::NewStub(Channel());
  grpc::ClientContext context;
  v1::SubscribeRequest request;
  request.set_session_id(joined.session_id());
  const auto stream = stub->Subscribe(&context, request);
  std::jthread clock([this](std::stop_token stop) {
    while (!stop.stop_requested()) {
      hub_.OnStatistics({});
      std::this_thread::sleep_for(milliseconds(50));
    }
  });
  const auto end = std::chrono::steady_clock::now() + milliseconds(1500);
  v1::Event event;
  while (std::chrono::steady_clock::now() < end) {
    ASSERT_TRUE(stream->Read(&event));
    grpc::ClientContext unary;
    v1::AcknowledgeRequest acknowledge;
    acknowledge.set_session_id(joined.session_id());
    acknowledge.set_sequence(event.sequence());
    v1::AcknowledgeResponse response;
    ASSERT_TRUE(stub->Acknowledge(&unary, acknowledge, &response).ok());
  }
  context.TryCancel();
}

}  // namespace
}  // namespace saccade::rpc_server_test
