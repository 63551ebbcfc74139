// Video, poses and map over real gRPC sockets, server in process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::stream_integration_test {
namespace {

using namespace std::chrono_literals;
using testing::InProcessServer;
using testing::ReceivedEvent;
using testing::TestClient;
using Events = std::vector<ReceivedEvent>;

v1::SubscribeRequest Topics(std::initializer_list<v1::Topic> topics, std::uint32_t window = 0) {
  v1::SubscribeRequest request;
  for (const v1::Topic topic : topics) request.add_topics(topic);
  request.set_window(window);
  return request;
}

std::vector<v1::AccessUnit> Video(const Events& events) {
  std::vector<v1::AccessUnit> units;
  for (const ReceivedEvent& one : events) {
    if (one.event.has_access_unit()) units.push_back(one.event.access_unit());
  }
  return units;
}

// Frames from `first` to `last` that arrived. A loaded machine drops frames before they are coded;
// that is the same for all, and no subscriber's loss.
std::vector<std::uint64_t> FramesBetween(const Events& events, std::uint64_t first,
                                         std::uint64_t last) {
  std::vector<std::uint64_t> frames;
  for (const v1::AccessUnit& unit : Video(events)) {
    if (unit.frame_id() >= first && unit.frame_id() <= last) frames.push_back(unit.frame_id());
  }
  return frames;
}

auto AtLeastVideo(std::size_t count) {
  return [count](const Events& events) { return Video(events).size() >= count; };
}

void ExpectNoGaps(const Events& events) {
  std::uint64_t expected = 1;
  for (const ReceivedEvent& one : events) EXPECT_EQ(one.event.sequence(), expected++);
}

TEST(Stream, ALateJoinerGetsStateThenAKeyFrameThenEveryFrame) {
  InProcessServer server;
  TestClient early(server.address());
  early.Subscribe();
  ASSERT_TRUE(early.WaitFor(AtLeastVideo(20)));
  TestClient late(server.address());
  late.Subscribe();
  ASSERT_TRUE(late.WaitFor(AtLeastVideo(15)));
  const Events events = late.events();
  ExpectNoGaps(events);
  ASSERT_TRUE(events[0].event.has_annotation());
  EXPECT_TRUE(events[0].event.annotation().full());
  ASSERT_TRUE(events[1].event.has_map());
  EXPECT_TRUE(events[1].event.map().full());
  EXPECT_EQ(events[1].event.map().upserted_size(), 20);
  const auto units = Video(events);
  EXPECT_TRUE(units[0].key_frame());
  const std::uint64_t first = units.front().frame_id(), last = units.back().frame_id();
  ASSERT_TRUE(early.WaitFor(
      [last](const Events& so_far) { return Video(so_far).back().frame_id() >= last; }));
  EXPECT_EQ(FramesBetween(events, first, last), FramesBetween(early.events(), first, last));
  for (std::size_t i = 0; i < units.size(); ++i) {
    EXPECT_EQ(units[i].pose().frame_id(), units[i].frame_id());
    EXPECT_GT(units[i].stages().encoded_ns(), units[i].stages().tracked_ns());
    EXPECT_GE(units[i].stages().tracked_ns(), units[i].stages().received_ns());
    EXPECT_GE(units[i].stages().queued_ns(), units[i].stages().encoded_ns());
  }
}

TEST(Stream, WithoutAcknowledgementItHoldsAndThenGoesOnWithTheNewest) {
  InProcessServer server;
  TestClient other(server.address());
  other.Subscribe();
  TestClient client(server.address());
  client.Subscribe(Topics({v1::TOPIC_VIDEO, v1::TOPIC_POSE}, 12), /*acknowledge=*/false);
  ASSERT_TRUE(client.WaitFor([](const Events& events) { return events.size() == 12; }));
  std::this_thread::sleep_for(2s);
  EXPECT_EQ(client.events().size(), 12u);
  const std::uint64_t newest = client.NewestFrame();
  client.Acknowledge(12);
  ASSERT_TRUE(client.WaitFor([](const Events& events) { return events.size() >= 20; }));
  const Events events = client.events();
  ExpectNoGaps(events);
  for (std::size_t i = 12; i < events.size(); ++i) {
    const v1::Event& event = events[i].event;
    const std::uint64_t frame =
        event.has_pose() ? event.pose().frame_id() : event.access_unit().frame_id();
    EXPECT_GE(frame + 1, newest) << "event " << i << " is of before the acknowledgement";
  }
  for (std::size_t i = 12; i < events.size(); ++i) {
    if (!events[i].event.has_access_unit()) continue;
    EXPECT_TRUE(events[i].event.access_unit().key_frame()) << "a delta of what it never had";
    break;
  }
  EXPECT_TRUE(other.WaitFor(AtLeastVideo(60)));
}

// The bar: the others lose nothing; who reads again is at most one second behind.
TEST(Stream, ASubscriberThatStopsReadingCostsNobodyAnything) {
  InProcessServer server;
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int i = 0; i < 5; ++i) {
    clients.push_back(std::make_unique<TestClient>(server.address()));
    clients.back()->Subscribe();
  }
  for (const auto& client : clients) ASSERT_TRUE(client->WaitFor(AtLeastVideo(10)));
  TestClient& stalled = *clients[0];
  stalled.PauseReading(true);
  std::this_thread::sleep_for(6s);
  const std::size_t before = stalled.events().size();
  const Timestamp resumed_ns = MonotonicNow();
  stalled.PauseReading(false);
  std::this_thread::sleep_for(2s);
  std::uint64_t first = 0, last = UINT64_MAX;
  for (std::size_t i = 1; i < clients.size(); ++i) {
    const auto units = Video(clients[i]->events());
    first = std::max<std::uint64_t>(first, units.front().frame_id());
    last = std::min<std::uint64_t>(last, units.back().frame_id());
  }
  const auto frames = FramesBetween(clients[1]->events(), first, last);
  EXPECT_GT(frames.size(), 120u);
  for (std::size_t i = 2; i < clients.size(); ++i) {
    EXPECT_EQ(FramesBetween(clients[i]->events(), first, last), frames) << "client " << i;
  }
  // What was on its way when it stopped is old; after one second nothing may be.
  const Events events = stalled.events();
  ExpectNoGaps(events);
  ASSERT_GT(events.size(), before + 40);
  std::size_t old = 0;
  for (std::size_t i = before; i < events.size(); ++i) {
    if (!events[i].event.has_access_unit()) continue;
    const double age_s =
        Seconds(events[i].received_ns - events[i].event.access_unit().stages().captured_ns());
    if (age_s > 1.0) ++old;
    if (Seconds(events[i].received_ns - resumed_ns) > 1.0) {
      EXPECT_LT(age_s, 1.0);
    }
  }
  EXPECT_LE(old, 32u) << "more than one window was kept for it";
  RecordProperty("old_units", static_cast<int>(old));
}

TEST(Stream, AKilledClientIsForgotten) {
  InProcessServer server;
  TestClient watcher(server.address());
  watcher.Subscribe(Topics({v1::TOPIC_PRESENCE}));
  const auto participants = [](int count) {
    return [count](const Events& events) {
      return !events.empty() && events.back().event.presence().participants_size() == count;
    };
  };
  ASSERT_TRUE(watcher.WaitFor(participants(1)));
  {
    testing::Process probe(
        {STREAM_PROBE, "--server", server.address(), "--subscribers", "3", "--seconds", "60"});
    ASSERT_TRUE(watcher.WaitFor(participants(4), 10s));
    probe.Signal(SIGKILL);
    ASSERT_TRUE(watcher.WaitFor(participants(1), 5s));
  }
}

TEST(Stream, AfterTheEndOfTheSourceALateJoinerStillSeesTheLastFrame) {
  testing::InProcessOptions options;
  options.frames = 20;
  InProcessServer server(options);
  TestClient first(server.address());
  first.Subscribe();
  const auto ended = [](const Events& events) {
    for (const ReceivedEvent& one : events) {
      if (one.event.has_end_of_source()) return one.event.end_of_source().frames() == 20;
    }
    return false;
  };
  ASSERT_TRUE(first.WaitFor(ended));
  TestClient late(server.address());
  late.Subscribe();
  ASSERT_TRUE(late.WaitFor(ended));
  ASSERT_TRUE(late.WaitFor(AtLeastVideo(1)));
  const v1::AccessUnit unit = Video(late.events())[0];
  EXPECT_TRUE(unit.key_frame());
  EXPECT_EQ(unit.frame_id(), 19u);
}

TEST(Stream, BothViewsAreServedSideBySide) {
  InProcessServer server;
  TestClient raw(server.address()), augmented(server.address());
  raw.Subscribe(Topics({v1::TOPIC_VIDEO}));
  v1::SubscribeRequest request = Topics({v1::TOPIC_VIDEO});
  request.set_video_view(v1::VIDEO_VIEW_AUGMENTED);
  augmented.Subscribe(request);
  ASSERT_TRUE(raw.WaitFor(AtLeastVideo(5)));
  ASSERT_TRUE(augmented.WaitFor(AtLeastVideo(5)));
  EXPECT_EQ(Video(augmented.events())[0].view(), v1::VIDEO_VIEW_AUGMENTED);
  EXPECT_EQ(Video(raw.events())[0].view(), v1::VIDEO_VIEW_RAW);
}

TEST(Stream, ASecondStreamOfASessionReplacesTheFirst) {
  InProcessServer server;
  TestClient client(server.address());
  client.Subscribe();
  ASSERT_TRUE(client.WaitFor(AtLeastVideo(2)));
  grpc::ClientContext context;
  v1::SubscribeRequest request;
  request.set_session_id(client.session_id());
  const auto second = client.session().Subscribe(&context, request);
  EXPECT_EQ(client.WaitForEnd().error_code(), grpc::StatusCode::ABORTED);
  v1::Event event;
  EXPECT_TRUE(second->Read(&event));
  EXPECT_EQ(event.sequence(), 1u);
  context.TryCancel();
}

TEST(Stream, ShutdownEndsOpenStreamsWithinTwoSeconds) {
  auto server = std::make_unique<InProcessServer>();
  TestClient reading(server->address()), stalled(server->address());
  reading.Subscribe();
  stalled.Subscribe();
  ASSERT_TRUE(reading.WaitFor(AtLeastVideo(5)));
  stalled.PauseReading(true);
  std::this_thread::sleep_for(1500ms);
  const auto begin = std::chrono::steady_clock::now();
  server->Stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
  EXPECT_EQ(reading.WaitForEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
}

}  // namespace
}  // namespace saccade::stream_integration_test
