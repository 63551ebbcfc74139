#include "server/rpc/video_queue.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::video_queue_test {
namespace {

using testing::MakePacket;

constexpr Timestamp kMs = 1'000'000;

// Takes packets and fails if one refers to something that was not taken.
class Decoder {
 public:
  void Take(const VideoPacket& packet) {
    const std::uint64_t index = packet.sequence - 1;
    if (packet.key_frame) {
      base_ = lower_ = index;
      started_ = true;
    } else {
      ASSERT_TRUE(started_) << "delta before the first key frame";
      if (packet.temporal_layer == 0) {
        ASSERT_EQ(index - base_, 4u) << "layer 0 lost";
        base_ = lower_ = index;
      } else if (packet.temporal_layer == 1) {
        ASSERT_EQ(index - base_, 2u) << "layer 1 without its layer 0";
        lower_ = index;
      } else {
        ASSERT_EQ(index - lower_, 1u) << "layer 2 without the picture below it";
      }
    }
    ++count;
    layers[static_cast<std::size_t>(packet.temporal_layer)] += 1;
  }
  int count = 0;
  std::array<int, 3> layers{};

 private:
  bool started_ = false;
  std::uint64_t base_ = 0, lower_ = 0;
};

TEST(VideoQueue, AFastSubscriberGetsEverything) {
  VideoQueue queue;
  Decoder decoder;
  for (std::uint64_t i = 0; i < 100; ++i) {
    queue.Push(MakePacket(i, i == 0));
    while (const auto packet = queue.Take(0)) decoder.Take(*packet);
  }
  EXPECT_EQ(decoder.count, 100);
  EXPECT_EQ(queue.skipped(), 0u);
}

TEST(VideoQueue, StartsWithAKeyFrameAndAsksForOne) {
  VideoQueue queue;
  for (std::uint64_t i = 5; i < 9; ++i) queue.Push(MakePacket(i));
  EXPECT_EQ(queue.Take(0), nullptr);
  EXPECT_TRUE(queue.WantsKeyFrame(1 * kMs));
  EXPECT_FALSE(queue.WantsKeyFrame(100 * kMs));  // asked already
  EXPECT_TRUE(queue.WantsKeyFrame(700 * kMs));   // in vain: again
  queue.Push(MakePacket(9, true));
  EXPECT_FALSE(queue.WantsKeyFrame(2000 * kMs));
  ASSERT_NE(queue.Take(0), nullptr);
  EXPECT_EQ(queue.skipped(), 0u);  // nobody missed what came before the stream began
}

// One packet taken for each `period` pushed: what arrives is decodable, and the lowest layers.
class SlowSubscriber : public ::testing::TestWithParam<int> {};

TEST_P(SlowSubscriber, ShedsUpperLayersAndStaysDecodable) {
  const int period = GetParam();
  VideoQueue queue;
  Decoder decoder;
  for (std::uint64_t i = 0; i < 400; ++i) {
    queue.Push(MakePacket(i, i == 0));
    if (i % static_cast<std::uint64_t>(period) != 0) continue;
    if (const auto packet = queue.Take(0)) decoder.Take(*packet);
    if (HasFatalFailure()) return;
  }
  EXPECT_GE(decoder.layers[0], 99) << "layer 0 is a quarter of the rate: all of it fits";
  EXPECT_NEAR(decoder.count, 400 / period, 6);
  EXPECT_GT(queue.skipped(), 0u);
}
INSTANTIATE_TEST_SUITE_P(Rates, SlowSubscriber, ::testing::Values(2, 3, 4));

TEST(VideoQueue, AStoppedSubscriberWaitsForAKeyFrame) {
  VideoQueue queue;
  Decoder decoder;
  queue.Push(MakePacket(0, true));
  decoder.Take(*queue.Take(0));
  for (std::uint64_t i = 1; i < 300; ++i) queue.Push(MakePacket(i));
  EXPECT_EQ(queue.Take(0), nullptr);  // not a backlog of ten seconds
  EXPECT_TRUE(queue.WantsKeyFrame(1));
  queue.Push(MakePacket(300, true));
  queue.Push(MakePacket(301));
  EXPECT_TRUE(queue.Take(0)->key_frame);
  EXPECT_EQ(queue.Take(0)->sequence, 302u);
}

TEST(VideoQueue, WhatIsOldIsNotSent) {
  VideoQueue queue;
  queue.Push(MakePacket(0, true, 0));
  queue.Push(MakePacket(1, false, 30 * kMs));
  EXPECT_EQ(queue.Take(900 * kMs), nullptr);
  EXPECT_TRUE(queue.WantsKeyFrame(900 * kMs));
}

TEST(VideoQueue, AGapInTheStreamCostsAKeyFrame) {
  VideoQueue queue;
  queue.Push(MakePacket(0, true));
  ASSERT_NE(queue.Take(0), nullptr);
  queue.Push(MakePacket(2));
  EXPECT_EQ(queue.Take(0), nullptr);
  EXPECT_TRUE(queue.WantsKeyFrame(1));
}

TEST(VideoQueue, AnyPaceIsDecodable) {
  std::mt19937 random(11);
  for (int run = 0; run < 200; ++run) {
    VideoQueue queue;
    Decoder decoder;
    std::uniform_int_distribution<int> percent(0, 99);
    const int pace = percent(random);
    for (std::uint64_t i = 0; i < 200; ++i) {
      const bool key_frame = i == 0 || (i % 4 == 0 && percent(random) < 10);
      queue.Push(MakePacket(i, key_frame));
      while (percent(random) < pace) {
        const auto packet = queue.Take(0);
        if (packet == nullptr) break;
        decoder.Take(*packet);
        if (HasFatalFailure()) return;
      }
    }
  }
}

}  // namespace
}  // namespace saccade::video_queue_test
