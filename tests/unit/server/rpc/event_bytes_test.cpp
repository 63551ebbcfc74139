#include "server/rpc/event_bytes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/packet_backlog.hpp"
#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::event_bytes_test {
namespace {

using testing::MakePacket;
using testing::MakeTracked;

SubscriptionOptions Everything() {
  SubscriptionOptions options;
  options.topics.set();
  options.window = 256;
  return options;
}

std::vector<EncodedEvent> Drain(Subscription& subscription, Timestamp now_ns) {
  std::vector<EncodedEvent> events;
  EncodedEvent event;
  while (subscription.Next(now_ns, event)) events.push_back(event);
  return events;
}

TEST(EventBytes, SubscribersShareWhatTheyGetAlike) {
  const auto bytes = std::make_shared<EventBytes>();
  Subscription one(Everything(), bytes), other(Everything(), bytes);
  ChangeLog log;
  for (FrameId id = 0; id < 3; ++id) {
    TrackedEvent tracked = MakeTracked(id);
    auto snapshot = std::make_shared<MapSnapshot>(*tracked.snapshot);
    snapshot->features[0].point_in_world.x() = static_cast<double>(id);
    tracked.snapshot = snapshot;
    const NumberedState state = log.Next(tracked, 0);
    const auto packet = MakePacket(id, id == 0, 1000);
    for (Subscription* subscription : {&one, &other}) {
      subscription->Offer(state);
      subscription->Offer(packet);
    }
    const std::vector<EncodedEvent> first = Drain(one, 7), second = Drain(other, 8);
    ASSERT_EQ(first.size(), second.size());
    int pictures = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      if (id > 0) {
        EXPECT_EQ(first[i].shared, second[i].shared) << "encoded twice";
      }
      v1::Event event;
      ASSERT_TRUE(event.ParseFromString(first[i].Joined()));
      if (!event.has_access_unit()) continue;
      ++pictures;
      EXPECT_EQ(event.access_unit().frame_id(), id);
      EXPECT_EQ(event.access_unit().data(), "data");
      EXPECT_EQ(event.access_unit().stages().queued_ns(), 7) << "each stream's own";
      EXPECT_EQ(event.access_unit().stages().encoded_ns(), 1000) << "beside what is shared";
    }
    EXPECT_EQ(pictures, 1);
  }
}

TEST(EventBytes, WhoIsBehindGetsItsOwn) {
  const auto bytes = std::make_shared<EventBytes>();
  Subscription fast(Everything(), bytes), slow(Everything(), bytes);
  ChangeLog log;
  v1::Event event;
  const auto publish = [&](int features) {
    TrackedEvent tracked = MakeTracked(static_cast<FrameId>(features));
    auto snapshot = std::make_shared<MapSnapshot>(*tracked.snapshot);
    snapshot->features.resize(static_cast<std::size_t>(features));
    for (int i = 0; i < features; ++i) {
      snapshot->features[static_cast<std::size_t>(i)].id = static_cast<FeatureId>(i);
    }
    tracked.snapshot = snapshot;
    const NumberedState state = log.Next(tracked, 0);
    fast.Offer(state);
    slow.Offer(state);
    Drain(fast, 0);
  };
  publish(1);
  Drain(slow, 0);
  for (int features = 2; features < 6; ++features) publish(features);
  int received = 0;
  for (const EncodedEvent& encoded : Drain(slow, 0)) {
    ASSERT_TRUE(event.ParseFromString(encoded.Joined()));
    received += event.map().upserted_size();
  }
  EXPECT_EQ(received, 4) << "all that came since, once";
}

std::vector<int> Kept(PacketBacklog& backlog) {
  std::vector<int> kept;
  for (const PacketBacklog::Entry& entry : backlog.TakeAll()) {
    if (!entry.shed) kept.push_back(static_cast<int>(entry.packet->sequence) - 1);
  }
  return kept;
}

TEST(PacketBacklog, ShedsLayer2ThenLayer1AndWhatIsBeforeAKeyFrame) {
  PacketBacklog backlog;
  for (std::uint64_t i = 0; i < 2; ++i) backlog.Push(MakePacket(i, i == 0));
  EXPECT_THAT(Kept(backlog), ::testing::ElementsAre(0, 1));
  for (std::uint64_t i = 2; i < 5; ++i) backlog.Push(MakePacket(i));
  EXPECT_THAT(Kept(backlog), ::testing::ElementsAre(2, 4)) << "3 is of layer 2";
  for (std::uint64_t i = 5; i < 21; ++i) backlog.Push(MakePacket(i));
  EXPECT_THAT(Kept(backlog), ::testing::ElementsAre(8, 12, 16, 20));
  for (std::uint64_t i = 21; i < 40; ++i) backlog.Push(MakePacket(i, i == 36));
  EXPECT_THAT(Kept(backlog), ::testing::ElementsAre(36, 38)) << "nothing before a key frame";
}

// What a hub in arrears hands on is decodable by every subscriber.
TEST(PacketBacklog, WhatIsLeftIsDecodable) {
  for (const std::uint64_t pace : {1, 2, 3, 5, 8, 13}) {
    PacketBacklog backlog;
    VideoQueue queue;
    std::vector<std::uint64_t> taken;
    for (std::uint64_t i = 0; i < 400; ++i) {
      backlog.Push(MakePacket(i, i == 0));
      if (i % pace != 0) continue;
      for (const PacketBacklog::Entry& entry : backlog.TakeAll()) {
        entry.shed ? queue.Skip(*entry.packet) : queue.Push(entry.packet);
        while (const auto packet = queue.Take(0)) taken.push_back(packet->sequence - 1);
      }
    }
    EXPECT_FALSE(queue.WantsKeyFrame(1)) << pace;
    std::uint64_t base = 0, lower = 0;
    for (const std::uint64_t i : taken) {
      if (i % 4 == 0) {
        EXPECT_EQ(i == 0 ? 0 : i - 4, base) << "layer 0 lost at pace " << pace;
        base = lower = i;
      } else if (i % 4 == 2) {
        EXPECT_EQ(i - 2, base);
        lower = i;
      } else {
        EXPECT_EQ(i - 1, lower) << "layer 2 without the picture below it";
      }
    }
    EXPECT_GE(taken.size(), 95u);
  }
}

}  // namespace
}  // namespace saccade::event_bytes_test
