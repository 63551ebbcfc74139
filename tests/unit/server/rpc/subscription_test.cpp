#include "server/rpc/subscription.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::subscription_test {
namespace {

using testing::MakePacket;
using testing::MakeTracked;
using Case = v1::Event::EventCase;
using Subscription = testing::FedSubscription;

SubscriptionOptions Everything(std::uint32_t window = 32) {
  SubscriptionOptions options;
  options.topics.set();
  options.window = window;
  return options;
}

std::vector<v1::Event> Drain(Subscription& subscription, Timestamp now_ns = 0) {
  std::vector<v1::Event> events;
  v1::Event event;
  while (subscription.Next(now_ns, event)) events.push_back(event);
  return events;
}

TEST(Subscription, ALateJoinerHasAnnotationsAndMapBeforeThePicture) {
  Subscription subscription(Everything());
  subscription.Offer(MakeTracked(7));
  subscription.Offer(MakePacket(6));  // a delta of a stream that it never saw
  subscription.Offer(MakePacket(8, true));
  subscription.OfferPresence(std::make_shared<v1::PresenceEvent>());
  std::vector<Case> cases;
  for (const v1::Event& event : Drain(subscription)) cases.push_back(event.event_case());
  EXPECT_THAT(cases, ::testing::ElementsAre(Case::kAnnotation, Case::kMap, Case::kPresence,
                                            Case::kGaze, Case::kPose, Case::kAccessUnit));
}

TEST(Subscription, SequenceHasNoGaps) {
  Subscription subscription(Everything(256));
  std::uint64_t expected = 1;
  for (std::uint64_t i = 0; i < 40; ++i) {
    subscription.Offer(MakeTracked(i));
    subscription.Offer(MakePacket(i, i == 0));
    for (const v1::Event& event : Drain(subscription)) EXPECT_EQ(event.sequence(), expected++);
  }
  EXPECT_EQ(subscription.last_sequence() + 1, expected);
}

TEST(Subscription, WithoutAcknowledgementItHoldsAfterTheWindowAndGoesOnWithTheNewest) {
  SubscriptionOptions options;
  options.topics.set(v1::TOPIC_POSE);
  options.window = 4;
  Subscription subscription(options);
  std::vector<FrameId> frames;
  for (FrameId id = 0; id < 100; ++id) {
    subscription.Offer(MakeTracked(id));
    for (const v1::Event& event : Drain(subscription)) frames.push_back(event.pose().frame_id());
  }
  EXPECT_THAT(frames, ::testing::ElementsAre(0, 1, 2, 3));
  ASSERT_TRUE(subscription.Acknowledge(4, false).ok());
  const std::vector<v1::Event> next = Drain(subscription);
  ASSERT_EQ(next.size(), 1u);
  EXPECT_EQ(next[0].pose().frame_id(), 99u);
  EXPECT_EQ(next[0].sequence(), 5u);
}

TEST(Subscription, AcknowledgingTheFutureIsAnError) {
  Subscription subscription(Everything());
  EXPECT_EQ(subscription.Acknowledge(1, false).code(), absl::StatusCode::kInvalidArgument);
  subscription.Offer(MakeTracked(0));
  Drain(subscription);
  EXPECT_TRUE(subscription.Acknowledge(2, false).ok());
  EXPECT_TRUE(subscription.Acknowledge(1, false).ok());  // late: cumulative, nothing is lost
}

TEST(Subscription, AsksForAKeyFrameOnlyWhileItMaySend) {
  SubscriptionOptions options;
  options.topics.set(v1::TOPIC_VIDEO);
  options.window = 1;
  Subscription subscription(options);
  EXPECT_TRUE(subscription.WantsKeyFrame(1));
  subscription.Offer(MakePacket(0, true));
  EXPECT_EQ(Drain(subscription).size(), 1u);
  for (std::uint64_t i = 1; i < 50; ++i) subscription.Offer(MakePacket(i));
  EXPECT_FALSE(subscription.WantsKeyFrame(2)) << "its window is closed";
  ASSERT_TRUE(subscription.Acknowledge(1, false).ok());
  EXPECT_TRUE(Drain(subscription).empty());
  EXPECT_TRUE(subscription.WantsKeyFrame(3));
}

TEST(Subscription, VideoDoesNotStarveTheMap) {
  Subscription subscription(Everything(256));
  v1::Event event;
  int maps = 0;
  for (std::uint64_t i = 0; i < 60; ++i) {
    TrackedEvent tracked = MakeTracked(i);
    auto snapshot = std::make_shared<MapSnapshot>(*tracked.snapshot);
    snapshot->features[0].point_in_world.x() = static_cast<double>(i);
    tracked.snapshot = snapshot;
    subscription.Offer(tracked);
    subscription.Offer(MakePacket(i, i == 0));
    // A link that takes two events a frame where three are due.
    for (int k = 0; k < 2 && subscription.Next(0, event); ++k) {
      maps += event.event_case() == Case::kMap ? 1 : 0;
    }
  }
  EXPECT_GE(maps, 20);
}

TEST(Subscription, OnlyTheTopicsAskedFor) {
  v1::SubscribeRequest request;
  request.add_topics(v1::TOPIC_STATISTICS);
  const auto options = SubscriptionOptions::FromProto(request);
  ASSERT_TRUE(options.ok());
  Subscription subscription(*options);
  subscription.Offer(MakeTracked(0));
  subscription.Offer(MakePacket(0, true));
  subscription.Offer(EngineStatistics{});
  const auto events = Drain(subscription);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_TRUE(events[0].has_statistics());
  EXPECT_FALSE(subscription.WantsKeyFrame(1));
}

// Frame `id` measured feature 5 at {10 + id, 20}, sought 6 at {30, 40.5} in vain, did not try 7 in
// view.
std::shared_ptr<const VideoPacket> PacketWithFeatures(FrameId id, bool key_frame) {
  auto packet = std::make_shared<VideoPacket>(*MakePacket(id, key_frame));
  auto snapshot = std::make_shared<MapSnapshot>(*packet->tracked.snapshot);
  snapshot->features.resize(3);
  for (std::size_t i = 0; i < 3; ++i) snapshot->features[i].id = 5 + i;
  snapshot->features[0].state = FeatureState::kMeasured;
  snapshot->features[0].pixel = Eigen::Vector2d(10.0 + static_cast<double>(id), 20.0);
  snapshot->features[1].state = FeatureState::kFailed;
  snapshot->features[1].pixel = Eigen::Vector2d(30.0, 40.5);
  snapshot->features[2].pixel = Eigen::Vector2d(50.0, 60.0);
  packet->tracked.snapshot = snapshot;
  return packet;
}

TEST(Subscription, APictureSaysWhatItsOwnFrameMeasured) {
  Subscription subscription(Everything());
  for (const FrameId id : {FrameId{0}, FrameId{1}}) {
    // The newest frame is further on than the picture, as while coding: it must not matter.
    subscription.Offer(MakeTracked(id + 7));
    subscription.Offer(PacketWithFeatures(id, id == 0));
    int pictures = 0;
    for (const v1::Event& event : Drain(subscription)) {
      if (!event.has_access_unit()) continue;
      ++pictures;
      const v1::AccessUnit& unit = event.access_unit();
      ASSERT_EQ(unit.frame_id(), id);
      ASSERT_TRUE(unit.has_features());
      EXPECT_THAT(unit.features().measured_ids(), ::testing::ElementsAre(5));
      EXPECT_THAT(unit.features().measured_px16(),
                  ::testing::ElementsAre(160 + 16 * static_cast<int>(id), 320));
      EXPECT_THAT(unit.features().failed_ids(), ::testing::ElementsAre(6));
      EXPECT_THAT(unit.features().failed_px16(), ::testing::ElementsAre(480, 648));
    }
    EXPECT_EQ(pictures, 1);
  }
}

TEST(Subscription, WithoutTheMapAPictureCarriesNoFeatures) {
  SubscriptionOptions options;
  options.topics.set(v1::TOPIC_VIDEO);
  options.window = 32;
  Subscription subscription(options);
  subscription.Offer(PacketWithFeatures(0, true));
  const std::vector<v1::Event> events = Drain(subscription);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_FALSE(events[0].access_unit().has_features());
}

TEST(SubscriptionOptions, BadRequestsNameTheField) {
  v1::SubscribeRequest request;
  request.set_window(1000);
  EXPECT_THAT(std::string(SubscriptionOptions::FromProto(request).status().message()),
              ::testing::StartsWith("window: "));
  request.set_window(8);
  request.add_topics(static_cast<v1::Topic>(99));
  EXPECT_THAT(std::string(SubscriptionOptions::FromProto(request).status().message()),
              ::testing::StartsWith("topics[0]: "));
  request.clear_topics();
  request.set_video_view(static_cast<v1::VideoView>(7));
  EXPECT_THAT(std::string(SubscriptionOptions::FromProto(request).status().message()),
              ::testing::StartsWith("video_view: "));
}

}  // namespace
}  // namespace saccade::subscription_test
