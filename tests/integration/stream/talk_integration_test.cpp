// The wearer's large pause, chat and voice over real gRPC sockets, server in process.
#include <absl/strings/str_format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "saccade/v1/talk.grpc.pb.h"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"

namespace saccade::talk_integration_test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
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

std::size_t Pictures(const Events& events) {
  std::size_t count = 0;
  for (const ReceivedEvent& one : events) count += one.event.has_access_unit();
  return count;
}

std::size_t Poses(const Events& events) {
  std::size_t count = 0;
  for (const ReceivedEvent& one : events) count += one.event.has_pose();
  return count;
}

grpc::Status Pause(TestClient& client, bool paused) {
  grpc::ClientContext context;
  v1::PausePictureRequest request;
  request.set_session_id(client.session_id());
  request.set_paused(paused);
  v1::PausePictureResponse response;
  return client.session().PausePicture(&context, request, &response);
}

grpc::Status GetFrame(TestClient& client, std::optional<std::uint64_t> id, v1::VideoView view) {
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  if (id) request.set_frame_id(*id);
  request.set_view(view);
  v1::GetFrameResponse response;
  return client.session().GetFrame(&context, request, &response);
}

v1::GetStatusResponse StatusOf(TestClient& client) {
  grpc::ClientContext context;
  v1::GetStatusResponse response;
  EXPECT_TRUE(client.session().GetStatus(&context, {}, &response).ok());
  return response;
}

/// Of one server, beside a TestClient's own stubs.
std::unique_ptr<v1::TalkService::Stub> TalkStub(const InProcessServer& server) {
  return v1::TalkService::NewStub(
      grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
}

grpc::Status Say(v1::TalkService::Stub& talk, const TestClient& client, const std::string& text,
                 v1::SayResponse& response, const std::string& request_id = "",
                 const std::string& mark = "") {
  grpc::ClientContext context;
  v1::SayRequest request;
  request.set_session_id(client.session_id());
  request.set_request_id(request_id);
  request.set_text(text);
  request.set_annotation_id(mark);
  return talk.Say(&context, request, &response);
}

grpc::Status Speak(v1::TalkService::Stub& talk, const std::string& session_id, std::uint64_t first,
                   int count, std::size_t bytes = 80) {
  grpc::ClientContext context;
  v1::SpeakRequest request;
  request.set_session_id(session_id);
  for (int i = 0; i < count; ++i) {
    v1::VoicePacket& packet = *request.add_packets();
    packet.set_sequence(first + static_cast<std::uint64_t>(i));
    packet.set_capture_ns(MonotonicNow());
    packet.set_opus(std::string(bytes, 'o'));
  }
  v1::SpeakResponse response;
  return talk.Speak(&context, request, &response);
}

TEST(PicturePause, StopsEveryPictureForEverybodyAndGoesOnByAKeyFrame) {
  InProcessServer server;
  TestClient wearer(server.address(), v1::ROLE_WEARER);
  TestClient raw(server.address()), augmented(server.address());
  raw.Subscribe();
  v1::SubscribeRequest view;
  view.set_video_view(v1::VIDEO_VIEW_AUGMENTED);
  augmented.Subscribe(view);
  const auto some = [](const Events& events) { return Pictures(events) >= 15; };
  ASSERT_TRUE(raw.WaitFor(some));
  ASSERT_TRUE(augmented.WaitFor(some));
  const std::uint64_t before = raw.NewestFrame();
  ASSERT_TRUE(GetFrame(raw, before, v1::VIDEO_VIEW_RAW).ok());
  ASSERT_TRUE(Pause(wearer, true).ok());
  // What was written when it was answered is on its way; nothing after.
  std::this_thread::sleep_for(100ms);
  const std::uint64_t last_shown = raw.NewestFrame();
  const std::size_t raw_pictures = Pictures(raw.events());
  const std::size_t augmented_pictures = Pictures(augmented.events());
  const std::size_t poses = Poses(raw.events());
  TestClient late(server.address());
  late.Subscribe();
  late.Acknowledge(0, /*request_key_frame=*/true);
  std::vector<std::uint64_t> during;
  for (int i = 0; i < 10; ++i) {
    std::this_thread::sleep_for(100ms);
    during.push_back(raw.NewestFrame());
    if (i % 4 != 0) continue;  // within what may be asked for
    for (const v1::VideoView one : {v1::VIDEO_VIEW_RAW, v1::VIDEO_VIEW_AUGMENTED}) {
      for (const std::optional<std::uint64_t> id :
           {std::optional<std::uint64_t>(), std::optional(before), std::optional(during.back())}) {
        const grpc::Status still = GetFrame(raw, id, one);
        EXPECT_EQ(still.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
        EXPECT_THAT(still.error_message(), HasSubstr("tester has paused"));
      }
    }
  }
  EXPECT_EQ(Pictures(raw.events()), raw_pictures);
  EXPECT_EQ(Pictures(augmented.events()), augmented_pictures);
  EXPECT_EQ(Pictures(late.events()), 0u);
  EXPECT_GT(Poses(raw.events()), poses + 15) << "tracking goes on";
  EXPECT_GT(during.back(), last_shown + 10);
  double bit_rate_bit_s = 1e9;  // of the last seconds
  for (int i = 0; i < 50 && bit_rate_bit_s > 0.0; ++i) {
    std::this_thread::sleep_for(100ms);
    bit_rate_bit_s = StatusOf(raw).statistics().video_bit_rate_bit_s();
  }
  EXPECT_EQ(bit_rate_bit_s, 0.0) << "none is coded";
  EXPECT_TRUE(StatusOf(raw).picture_pause().paused());
  EXPECT_EQ(StatusOf(raw).picture_pause().by(), "tester");
  EXPECT_TRUE(late.WaitFor([](const Events& events) {
    for (const ReceivedEvent& one : events) {
      if (one.event.picture_pause().paused()) return true;
    }
    return false;
  })) << "who comes is told at once";

  ASSERT_TRUE(Pause(wearer, false).ok());
  for (TestClient* client : {&raw, &augmented, &late}) {
    const std::size_t had = client == &raw         ? raw_pictures
                            : client == &augmented ? augmented_pictures
                                                   : 0;
    ASSERT_TRUE(
        client->WaitFor([had](const Events& events) { return Pictures(events) >= had + 5; }));
    std::size_t index = 0;
    for (const ReceivedEvent& one : client->events()) {
      if (!one.event.has_access_unit() || index++ < had) continue;
      EXPECT_TRUE(one.event.access_unit().key_frame());
      EXPECT_GT(one.event.access_unit().frame_id(), during.back());
      break;
    }
  }
  EXPECT_TRUE(GetFrame(raw, before, v1::VIDEO_VIEW_RAW).ok()) << "it was seen before";
  for (const std::uint64_t id : during) {
    const grpc::Status still = GetFrame(raw, id, v1::VIDEO_VIEW_AUGMENTED);
    EXPECT_EQ(still.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << id;
    EXPECT_THAT(still.error_message(), HasSubstr("while the picture was paused"));
  }
  // Nobody was shown it, so nobody means a place in it; what was shown can be clicked.
  v1::CreateAnnotationResponse made;
  const grpc::Status click = raw.Create(raw.CubeAt(160, 120, during.back()), "", made);
  EXPECT_EQ(click.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(click.error_message(), HasSubstr("while the picture was paused"));
  EXPECT_TRUE(raw.Create(raw.CubeAt(160, 120, before), "", made).ok());
}

TEST(PicturePause, OnlyTheWearerPauses) {
  InProcessServer server;
  for (const v1::Role role : {v1::ROLE_EXPERT, v1::ROLE_VIEWER}) {
    TestClient client(server.address(), role);
    EXPECT_EQ(Pause(client, true).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  }
  TestClient wearer(server.address(), v1::ROLE_WEARER);
  EXPECT_FALSE(StatusOf(wearer).picture_pause().paused());
}

TEST(PicturePause, AServerThatStartsAgainShowsNothingUntilItIsLifted) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / absl::StrFormat("pause_test.%d", ::getpid());
  std::filesystem::create_directory(folder);
  testing::InProcessOptions options;
  options.data_dir = folder;
  {
    InProcessServer server(options);
    TestClient wearer(server.address(), v1::ROLE_WEARER);
    ASSERT_TRUE(Pause(wearer, true).ok());
  }
  {
    InProcessServer server(options);
    TestClient wearer(server.address(), v1::ROLE_WEARER);
    TestClient client(server.address());
    client.Subscribe();
    ASSERT_TRUE(client.WaitFor([](const Events& events) { return Poses(events) >= 20; }));
    EXPECT_EQ(Pictures(client.events()), 0u);
    EXPECT_EQ(GetFrame(client, std::nullopt, v1::VIDEO_VIEW_RAW).error_code(),
              grpc::StatusCode::FAILED_PRECONDITION);
    ASSERT_TRUE(Pause(wearer, false).ok());
    EXPECT_TRUE(client.WaitFor([](const Events& events) { return Pictures(events) >= 5; }));
  }
  std::filesystem::remove_all(folder);
}

TEST(Talk, AMessageReachesEverybodyOnceAndIsThereForWhoComesLater) {
  InProcessServer server;
  const auto talk = TalkStub(server);
  TestClient ann(server.address()), bea(server.address());
  ann.Subscribe(Topics({v1::TOPIC_CHAT}));
  bea.Subscribe();
  v1::SayResponse said;
  const std::string request = "00000000-0000-4000-8000-000000000001";
  ASSERT_TRUE(Say(*talk, ann, "the left screw", said, request).ok());
  EXPECT_EQ(said.message().number(), 1u);
  EXPECT_EQ(said.message().display_name(), "tester");
  EXPECT_EQ(said.message().participant_id(), ann.participant_id());
  ASSERT_TRUE(Say(*talk, ann, "the left screw", said, request).ok());
  EXPECT_EQ(said.message().number(), 1u);
  // A mark to look at.
  ASSERT_TRUE(ann.WaitFor([](const Events& events) { return !events.empty(); }));
  while (ann.NewestFrame() < 5) std::this_thread::sleep_for(50ms);
  v1::CreateAnnotationResponse mark;
  ASSERT_TRUE(ann.Create(ann.CubeAt(160, 120, ann.NewestFrame()), "", mark).ok());
  ASSERT_TRUE(Say(*talk, bea, "", said, "", mark.annotation().id()).ok());
  for (TestClient* client : {&ann, &bea}) {
    ASSERT_TRUE(client->WaitFor([&](const Events& events) {
      for (const ReceivedEvent& one : events) {
        for (const v1::ChatMessage& message : one.event.chat().messages()) {
          if (message.annotation_id() == mark.annotation().id()) return true;
        }
      }
      return false;
    }));
    std::vector<std::uint64_t> numbers;
    for (const ReceivedEvent& one : client->events()) {
      for (const v1::ChatMessage& message : one.event.chat().messages()) {
        numbers.push_back(message.number());
      }
    }
    EXPECT_THAT(numbers, ::testing::ElementsAre(1, 2));
  }
  TestClient late(server.address(), v1::ROLE_VIEWER);
  grpc::ClientContext context;
  v1::ListMessagesRequest list;
  list.set_session_id(late.session_id());
  list.set_after_number(1);
  v1::ListMessagesResponse kept;
  ASSERT_TRUE(talk->ListMessages(&context, list, &kept).ok());
  ASSERT_EQ(kept.messages_size(), 1);
  EXPECT_EQ(kept.messages(0).number(), 2u);
  EXPECT_EQ(Say(*talk, late, "me too", said).error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Talk, WhatIsNoMessageIsRefusedByName) {
  InProcessServer server;
  const auto talk = TalkStub(server);
  TestClient ann(server.address());
  v1::SayResponse said;
  const auto refused = [&](const std::string& text, const std::string& request,
                           const std::string& mark, const std::string& words) {
    const grpc::Status status = Say(*talk, ann, text, said, request, mark);
    EXPECT_THAT(status.error_message(), HasSubstr(words));
    return status.error_code();
  };
  using Code = grpc::StatusCode;
  EXPECT_EQ(refused("", "", "", "text: is empty"), Code::INVALID_ARGUMENT);
  EXPECT_EQ(refused(std::string(501, 'x'), "", "", "text: "), Code::INVALID_ARGUMENT);
  EXPECT_EQ(refused("a\tb", "", "", "text: "), Code::INVALID_ARGUMENT);
  EXPECT_EQ(refused("a", "one", "", "request_id: "), Code::INVALID_ARGUMENT);
  EXPECT_EQ(refused("a", "", "one", "annotation_id: "), Code::INVALID_ARGUMENT);
  EXPECT_EQ(refused("a", "", "00000000-0000-4000-8000-000000000001", "annotation_id: there is no"),
            Code::NOT_FOUND);
  EXPECT_TRUE(Say(*talk, ann, std::string(500, 'x'), said).ok());
  grpc::Status last;
  for (int i = 0; i < 40 && last.ok(); ++i) last = Say(*talk, ann, "again", said);
  EXPECT_EQ(last.error_code(), Code::RESOURCE_EXHAUSTED);
  EXPECT_THAT(last.error_message(), HasSubstr("too many messages from this session"));
}

// The bar: who stops reading costs nobody a word, and then hears what is said now.
TEST(Talk, VoiceGoesToAllWhoAskedButTheSpeakerAndASlowReaderCostsNobody) {
  InProcessServer server;
  const auto talk = TalkStub(server);
  TestClient speaker(server.address()), listener(server.address()), slow(server.address()),
      deaf(server.address());
  speaker.Subscribe(Topics({v1::TOPIC_VOICE}));
  listener.Subscribe(Topics({v1::TOPIC_VOICE, v1::TOPIC_VIDEO, v1::TOPIC_PRESENCE}));
  slow.Subscribe(Topics({v1::TOPIC_VOICE, v1::TOPIC_VIDEO}));
  deaf.Subscribe();
  ASSERT_TRUE(listener.WaitFor([](const Events& events) { return Pictures(events) >= 3; }));
  slow.PauseReading(true);
  constexpr int kPackets = 200;
  for (int i = 0; i < kPackets; i += 2) {
    ASSERT_TRUE(Speak(*talk, speaker.session_id(), static_cast<std::uint64_t>(i + 1), 2).ok());
    std::this_thread::sleep_for(38ms);
  }
  const auto heard = [](const Events& events) {
    std::vector<std::uint64_t> sequences;
    for (const ReceivedEvent& one : events) {
      for (const v1::VoicePacket& packet : one.event.voice().packets()) {
        sequences.push_back(packet.sequence());
      }
    }
    return sequences;
  };
  EXPECT_TRUE(
      listener.WaitFor([&](const Events& events) { return heard(events).size() == kPackets; }));
  std::uint64_t expected = 1;
  Timestamp worst_ns = 0;
  for (const ReceivedEvent& one : listener.events()) {
    if (one.event.has_voice()) {
      EXPECT_EQ(one.event.voice().participant_id(), speaker.participant_id());
    }
    for (const v1::VoicePacket& packet : one.event.voice().packets()) {
      EXPECT_EQ(packet.sequence(), expected++);
      EXPECT_EQ(packet.opus(), std::string(80, 'o'));
      worst_ns = std::max(worst_ns, one.received_ns - packet.capture_ns());
    }
  }
  EXPECT_LT(worst_ns, 300'000'000);
  EXPECT_TRUE(heard(speaker.events()).empty()) << "nobody hears themselves";
  EXPECT_TRUE(heard(deaf.events()).empty()) << "\"all\" leaves voice out";
  const v1::PresenceEvent presence = StatusOf(listener).presence();
  for (const v1::Participant& one : presence.participants()) {
    EXPECT_EQ(one.listens(), one.participant_id() != deaf.participant_id());
  }
  slow.PauseReading(false);
  EXPECT_TRUE(slow.WaitFor([&](const Events& events) {
    const std::vector<std::uint64_t> sequences = heard(events);
    return !sequences.empty() && sequences.back() == kPackets;
  })) << "the newest is heard";
}

TEST(Talk, WhatIsNoVoiceIsRefusedByName) {
  InProcessServer server;
  const auto talk = TalkStub(server);
  TestClient ann(server.address()), viewer(server.address(), v1::ROLE_VIEWER);
  using Code = grpc::StatusCode;
  EXPECT_EQ(Speak(*talk, ann.session_id(), 1, 0).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_THAT(Speak(*talk, ann.session_id(), 1, 26).error_message(), HasSubstr("packets: 26"));
  EXPECT_THAT(Speak(*talk, ann.session_id(), 1, 1, 401).error_message(),
              HasSubstr("packets[0].opus: 401 bytes"));
  EXPECT_EQ(Speak(*talk, ann.session_id(), 1, 1, 0).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Speak(*talk, viewer.session_id(), 1, 1).error_code(), Code::PERMISSION_DENIED);
  grpc::Status last;
  for (int i = 0; i < 20 && last.ok(); ++i) {
    last = Speak(*talk, ann.session_id(), static_cast<std::uint64_t>(25 * i), 25);
  }
  EXPECT_EQ(last.error_code(), Code::RESOURCE_EXHAUSTED) << "more than anybody speaks";
}

}  // namespace
}  // namespace saccade::talk_integration_test
