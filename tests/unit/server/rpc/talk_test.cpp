// What people say on its way: chat that is kept, voice that is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/chat_book.hpp"
#include "server/rpc/voice_queue.hpp"
#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::talk_test {
namespace {

using testing::MakePacket;
using testing::MakeTracked;
using Case = v1::Event::EventCase;
using Subscription = testing::FedSubscription;

v1::ChatMessage Message(const std::string& text, const std::string& participant = "ann") {
  v1::ChatMessage message;
  message.set_participant_id(participant);
  message.set_text(text);
  return message;
}

VoiceBatch Batch(const std::string& speaker, std::uint64_t first, int count) {
  VoiceBatch batch{speaker, {}};
  for (int i = 0; i < count; ++i) {
    auto packet = std::make_shared<v1::VoicePacket>();
    packet->set_sequence(first + static_cast<std::uint64_t>(i));
    packet->set_opus("opus");
    batch.packets.push_back(std::move(packet));
  }
  return batch;
}

SubscriptionOptions Topics(std::initializer_list<v1::Topic> topics, std::uint32_t window = 32) {
  SubscriptionOptions options;
  for (const v1::Topic topic : topics) options.topics.set(static_cast<std::size_t>(topic));
  options.window = window;
  return options;
}

TEST(ChatBook, NumbersRiseAndTheLast500AreKept) {
  ChatBook book;
  for (int i = 1; i <= 620; ++i) {
    EXPECT_EQ(book.Say(Message(std::to_string(i)), "")->number(), static_cast<std::uint64_t>(i));
  }
  const auto log = book.log();
  ASSERT_EQ(log->size(), 500u);
  EXPECT_EQ(log->front()->text(), "121");
  EXPECT_EQ((*After(*log, 400))->number(), 401u);
  EXPECT_EQ((*After(*log, 0))->number(), 121u) << "what is kept";
  EXPECT_EQ(After(*log, 620), log->end());
}

TEST(ChatBook, ARepeatedRequestIsSaidOnce) {
  ChatBook book;
  const std::string request = "00000000-0000-4000-8000-000000000001";
  EXPECT_EQ(book.Say(Message("look"), request)->number(), 1u);
  EXPECT_EQ(book.Say(Message("look"), request)->number(), 1u);
  EXPECT_EQ(book.Say(Message("mine", "bea"), request)->number(), 2u) << "somebody else's";
  EXPECT_EQ(book.Say(Message("a"), "")->number(), 3u);
  EXPECT_EQ(book.Say(Message("a"), "")->number(), 4u);
  EXPECT_EQ(book.log()->size(), 4u);
}

TEST(VoiceQueue, KeepsTheNewestHalfSecondOfEachSpeaker) {
  VoiceQueue queue;
  for (std::uint64_t first = 1; first <= 91; first += 10) queue.Push(Batch("ann", first, 10));
  queue.Push(Batch("bea", 7, 2));
  EXPECT_EQ(queue.skipped(), 75u);
  v1::VoiceEvent event;
  ASSERT_TRUE(queue.Take(event));
  EXPECT_EQ(event.participant_id(), "ann");
  ASSERT_EQ(event.packets_size(), 25);
  EXPECT_EQ(event.packets(0).sequence(), 76u);
  EXPECT_EQ(event.packets(24).sequence(), 100u);
  event.Clear();
  ASSERT_TRUE(queue.Take(event));
  EXPECT_EQ(event.participant_id(), "bea");
  EXPECT_FALSE(queue.Take(event));
}

TEST(VoiceQueue, IsBoundedHoweverManySpeak) {
  VoiceQueue queue;
  for (int speaker = 0; speaker < 100; ++speaker) {
    queue.Push(Batch("speaker" + std::to_string(speaker), 1, 25));
  }
  v1::VoiceEvent event;
  std::size_t events = 0;
  while (queue.Take(event)) ++events;
  EXPECT_EQ(events, VoiceQueue::kMaxSpeakers);
}

TEST(Subscription, VoiceGoesBeforePicturesAndBeyondTheWindow) {
  Subscription subscription(Topics({v1::TOPIC_VIDEO, v1::TOPIC_VOICE, v1::TOPIC_POSE}, 3));
  std::vector<Case> cases;
  v1::Event event;
  for (std::uint64_t i = 0; i < 5; ++i) {
    subscription.Offer(MakeTracked(i));
    subscription.Offer(MakePacket(i, i == 0));
    subscription.OfferVoice(Batch("ann", 1 + 2 * i, 2));
    while (subscription.Next(0, event)) cases.push_back(event.event_case());
  }
  // Three events are all that the window has; nobody acknowledged, and the voice went on.
  EXPECT_THAT(cases,
              ::testing::ElementsAre(Case::kVoice, Case::kPose, Case::kAccessUnit, Case::kVoice,
                                     Case::kVoice, Case::kVoice, Case::kVoice));
}

TEST(Subscription, VoiceOfWhoAcknowledgesNothingEndsAsWell) {
  Subscription subscription(Topics({v1::TOPIC_VOICE}, 4));
  v1::Event event;
  int events = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    subscription.OfferVoice(Batch("ann", i, 1));
    while (subscription.Next(0, event)) ++events;
  }
  EXPECT_EQ(events, 54);
  ASSERT_TRUE(subscription.Acknowledge(54, false).ok());
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_EQ(event.voice().packets_size(), 25) << "the newest, not all";
  EXPECT_EQ(event.voice().packets(24).sequence(), 499u);
}

TEST(Subscription, AllLeavesVoiceOut) {
  const auto all = SubscriptionOptions::FromProto(v1::SubscribeRequest());
  ASSERT_TRUE(all.ok());
  EXPECT_FALSE(all->topics.test(v1::TOPIC_VOICE));
  EXPECT_TRUE(all->topics.test(v1::TOPIC_CHAT));
  EXPECT_TRUE(all->topics.test(v1::TOPIC_PICTURE_PAUSE));
}

TEST(Subscription, ChatIsWhatIsSaidFromNowOnInOrderAndOnce) {
  ChatBook book;
  book.Say(Message("before"), "");
  Subscription subscription(Topics({v1::TOPIC_CHAT}));
  subscription.OfferChat(book.log());
  v1::Event event;
  EXPECT_FALSE(subscription.Next(0, event));
  for (int i = 0; i < 230; ++i) book.Say(Message("later"), "");
  subscription.OfferChat(book.log());
  std::uint64_t expected = 2;
  while (subscription.Next(0, event)) {
    EXPECT_LE(event.chat().messages_size(), 100);
    for (const v1::ChatMessage& message : event.chat().messages()) {
      EXPECT_EQ(message.number(), expected++);
    }
  }
  EXPECT_EQ(expected, 232u);
  subscription.OfferChat(book.log());
  EXPECT_FALSE(subscription.Next(0, event));
}

TEST(Subscription, SceneIsAllOfItFirstAndThenWhatChanged) {
  Subscription subscription(Topics({v1::TOPIC_SCENE}));
  const auto publish = [&](std::uint64_t revision, const std::vector<SceneObject>& objects) {
    Scene scene;
    scene.revision = revision;
    scene.objects = objects;
    subscription.OfferScene(std::make_shared<const Scene>(scene));
  };
  SceneObject room, crate;
  room.id = "r";
  crate.id = "c";
  publish(1, {room});
  v1::Event event;
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_TRUE(event.scene().full());
  ASSERT_EQ(event.scene().upserted_size(), 1);
  publish(2, {room, crate});
  crate.parent_from_object.translation.x() = 0.5;
  publish(3, {room, crate});
  publish(2, {room});  // late
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_FALSE(event.scene().full());
  EXPECT_EQ(event.scene().revision(), 3u);
  ASSERT_EQ(event.scene().upserted_size(), 1);
  EXPECT_EQ(event.scene().upserted(0).id(), "c");
  EXPECT_EQ(event.scene().upserted(0).parent_from_object().translation_m().x(), 0.5);
  publish(4, {crate});
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_EQ(event.scene().upserted_size(), 0);
  ASSERT_EQ(event.scene().removed_ids_size(), 1);
  EXPECT_EQ(event.scene().removed_ids(0), "r");
  EXPECT_FALSE(subscription.Next(0, event));
}

TEST(Subscription, TheLightIsToldWhenSomebodyWouldSeeIt) {
  Subscription subscription(Topics({v1::TOPIC_SCENE}));
  Scene scene;
  scene.revision = 1;
  subscription.OfferScene(std::make_shared<const Scene>(scene));
  v1::Event event;
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_EQ(event.scene().light().confidence(), 0);
  const auto lit = [&](double level) {
    NumberedState state;
    state.tracked.snapshot = std::make_shared<const MapSnapshot>();
    state.tracked.light = {level, Eigen::Vector3d(0, -0.4, 0), 0.8};
    subscription.Offer(state);
  };
  lit(0.7);
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_FALSE(event.scene().full());
  EXPECT_EQ(event.scene().revision(), 1u);
  EXPECT_EQ(event.scene().light().level(), 0.7);
  EXPECT_EQ(event.scene().light().toward_in_world().y(), -0.4);
  lit(0.71);
  EXPECT_FALSE(subscription.Next(0, event));
  lit(0.75);
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_EQ(event.scene().light().level(), 0.75);
  EXPECT_FALSE(subscription.Next(0, event));
}

TEST(EventBytes, APoseTellsWhereMarkersAre) {
  TrackedEvent tracked;
  tracked.snapshot = std::make_shared<const MapSnapshot>();
  const Rigid3 place{Eigen::Quaterniond(0, 1, 0, 0), {1, 2, 3}};
  tracked.markers = std::make_shared<const std::vector<MarkerPose>>(
      std::vector<MarkerPose>{{"apriltag36h11", 3, place, 77}});
  v1::PoseEvent pose;
  ASSERT_TRUE(pose.ParseFromString(*EventBytes().Pose(tracked)));
  ASSERT_EQ(pose.markers_size(), 1);
  EXPECT_EQ(pose.markers(0).family(), "apriltag36h11");
  EXPECT_EQ(pose.markers(0).id(), 3u);
  EXPECT_EQ(pose.markers(0).seen_ns(), 77);
  EXPECT_EQ(pose.markers(0).world_from_marker().translation_m().z(), 3);
  EXPECT_EQ(pose.markers(0).world_from_marker().rotation().x(), 1);
}

TEST(Subscription, WhilePausedNoPictureLeavesAndThenAKeyFrameIsFirst) {
  Subscription subscription(Topics({v1::TOPIC_VIDEO, v1::TOPIC_PICTURE_PAUSE}));
  const auto paused = std::make_shared<const PicturePause>(PicturePause{true, "Ann", 5});
  v1::Event event;
  subscription.Offer(MakePacket(0, true));
  ASSERT_TRUE(subscription.Next(0, event));
  subscription.Offer(MakePacket(1));  // waits
  subscription.OfferPicturePause(paused);
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_TRUE(event.picture_pause().paused());
  EXPECT_EQ(event.picture_pause().by(), "Ann");
  subscription.Offer(MakePacket(2, true));
  EXPECT_FALSE(subscription.Next(0, event)) << event.DebugString();
  EXPECT_FALSE(subscription.WantsKeyFrame(1)) << "what for?";
  subscription.OfferPicturePause(std::make_shared<const PicturePause>());
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_FALSE(event.picture_pause().paused());
  EXPECT_TRUE(subscription.WantsKeyFrame(2));
  subscription.Offer(MakePacket(3));
  EXPECT_FALSE(subscription.Next(0, event)) << "a delta of what it never had";
  subscription.Offer(MakePacket(4, true));
  ASSERT_TRUE(subscription.Next(0, event));
  EXPECT_TRUE(event.access_unit().key_frame());
}

}  // namespace
}  // namespace saccade::talk_test
