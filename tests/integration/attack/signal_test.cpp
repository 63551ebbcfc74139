// SIGTERM and SIGINT at any moment end the server within 2 s, and its data base stays whole.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <iostream>
#include <random>
#include <thread>

#include "saccade/v1/annotation.pb.h"
#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attack_test.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::signal_test {
namespace {

// 2 s are promised on a quiet machine; a busy one may add its own.
constexpr auto kEnd = milliseconds(2000);
constexpr auto kSlack = milliseconds(1000);

int CountAnnotations(Target& target) {
  v1::ListAnnotationsResponse response;
  const RawReply reply =
      Ask(target.NewChannel(), "AnnotationService/List", v1::ListAnnotationsRequest(), response);
  return reply.status.ok() ? response.annotations_size() : -1;
}

void PlaceThree(const std::string& data_dir) {
  TargetOptions options;
  options.data_dir = data_dir;
  Target target(options);
  const auto channel = target.NewChannel();
  v1::CreateAnnotationRequest request;
  request.set_session_id(JoinSession(channel, v1::ROLE_EXPERT));
  request.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_NOTE);
  request.mutable_draft()->set_text("mark");
  request.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_z(1);
  for (int i = 0; i < 3; ++i) {
    request.set_request_id("0e4a7f6a-52a1-4a55-8f0f-00000000000" + std::to_string(i));
    v1::CreateAnnotationResponse response;
    RawReply reply;
    do {  // until the first frame is tracked
      reply = Ask(channel, "AnnotationService/Create", request, response);
    } while (reply.Is(grpc::StatusCode::FAILED_PRECONDITION));
    ASSERT_TRUE(reply.status.ok()) << reply.status.error_message();
  }
  target.process().Signal(SIGTERM);
  ASSERT_EQ(target.process().Wait(kEnd + kSlack), 0);
}

milliseconds SinceIn(Clock::time_point from) {
  return std::chrono::duration_cast<milliseconds>(Clock::now() - from);
}

// One life: start, wait, signal, end. Exit code 0; 128 + n only before the server hears signals,
// that is before it is ready.
void LiveAndDie(const TargetOptions& options, milliseconds wait, int signal, Tally& tally) {
  Process process(LimitedServer(options, options.data_dir));
  std::this_thread::sleep_for(wait);
  const bool ready = process.WaitForLine("\"ready\"", milliseconds(0)).has_value();
  const auto from = Clock::now();
  process.Signal(signal);
  const std::optional<int> code = process.Wait(kEnd + kSlack);
  const std::string when = std::to_string(wait.count()) + " ms after the start" +
                           (ready ? ", ready" : ", not ready") + ", signal " +
                           std::to_string(signal);
  tally.Add(ready ? "signals when ready" : "signals before");
  if (!code) {
    ADD_FAILURE() << "still there " << SinceIn(from).count() << " ms after a signal: " << when;
    return;
  }
  tally.Add("exit code " + std::to_string(*code));
  if (SinceIn(from) > kEnd) tally.Add("ends later than 2 s");
  EXPECT_TRUE(*code == 0 || (!ready && *code == 128 + signal))
      << "exit code " << *code << ": " << when << "; " << process.err();
}

TEST(Signals, EndItAtFiftyRandomMoments) {
  constexpr int kSignals = 50, kWorkers = 2;
  constexpr unsigned kSeed = 50;
  Tally tally;
  std::vector<std::jthread> workers;
  for (int w = 0; w < kWorkers; ++w) {
    workers.emplace_back([w, &tally] {
      TemporaryFolder folder;
      PlaceThree(folder / "data");
      WriteSmallDataset(folder / "set", {.frames = 60});
      std::mt19937 random(kSeed + static_cast<unsigned>(w));
      for (int i = 0; i < kSignals / kWorkers; ++i) {
        const milliseconds wait(std::uniform_int_distribution<int>(0, 800)(random));
        TargetOptions options;  // the simulator takes its time to start, a data set none
        if (i % 2 == 1) options.source = "dataset:" + (folder / "set");
        options.data_dir = folder / "data";
        LiveAndDie(options, wait, random() % 2 == 0 ? SIGTERM : SIGINT, tally);
      }
      TargetOptions options;
      options.data_dir = folder / "data";
      Target target(options);
      EXPECT_EQ(CountAnnotations(target), 3) << "of three that were answered";
    });
  }
  workers.clear();
  std::cout << "note: seed " << kSeed << "; " << tally.ToString() << "\n";
}

void ExpectEnd(Target& target) {
  const auto from = Clock::now();
  target.process().Signal(SIGTERM);
  const std::optional<int> code = target.process().Wait(kEnd + kSlack);
  EXPECT_EQ(code, 0) << "after " << SinceIn(from).count() << " ms";
  std::cout << "note: ended after " << SinceIn(from).count() << " ms\n";
}

TEST(Signals, EndItWhileStreamsAreHeldAndPeersAreSilent) {
  Target target;
  Tally tally;
  const auto channel = target.NewChannel();
  HeldStreams streams;
  for (int i = 0; i < 100; ++i) {
    streams.Open(channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                 std::string("\x3a\0", 2));
    streams.Open(channel, "/grpc.health.v1.Health/Watch", "");
  }
  streams.open(milliseconds(500));
  std::vector<Socket> silent;
  for (int i = 0; i < 40; ++i) {
    silent.emplace_back(i % 2 == 0 ? target.grpc_port() : target.http_port(), 2048);
    v1::SubscribeRequest request;
    request.set_session_id(JoinSession(channel, v1::ROLE_VIEWER, milliseconds(300)));
    const std::string subscribe = "/saccade.v1.SessionService/Subscribe";
    const std::string bytes = request.SerializeAsString();
    silent.back().Send(i % 2 == 0 ? Http2Call(subscribe, bytes)
                                  : GrpcWebCall(target.http_port(), subscribe, bytes));
  }
  std::this_thread::sleep_for(seconds(1));
  ExpectEnd(target);
}

// Its stderr is a pipe that nobody reads: a line of log is never a reason to wait.
TEST(Signals, UnreadLogHoldsNothingUp) {
  TemporaryFolder folder;
  const std::string pipe = folder / "stderr";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  TargetOptions options;
  options.stderr_file = pipe;
  Target target(options);
  const auto channel = target.NewChannel();
  const FloodCall join = JoinCall();
  Tally tally;
  for (int i = 0; i < 1500; ++i) {
    const RawReply reply = Call(channel, join.method, join.request, seconds(2));
    tally.Add(reply.status);
    ASSERT_FALSE(reply.Is(grpc::StatusCode::DEADLINE_EXCEEDED)) << "Join " << i << " hangs";
  }
  std::cout << "note: " << tally.ToString() << "\n";
  EXPECT_EQ(target.Unwell(), "");
  ExpectEnd(target);
  close(reader);
}

}  // namespace
}  // namespace saccade::testing::signal_test
