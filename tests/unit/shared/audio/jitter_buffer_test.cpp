#include "shared/audio/jitter_buffer.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace saccade::jitter_buffer_test {
namespace {

constexpr Timestamp kMs = 1'000'000;
using Kind = JitterBuffer::Step::Kind;

struct Played {
  int packets = 0, missing = 0, disorder = 0;
  double worst_wait_ms = 0.0;
};

/// Plays `count` packets whose way takes `delay_ms(i)` (negative: lost), asking every 20 ms.
template <typename Delay>
Played Play(JitterBuffer& buffer, int count, Delay delay_ms) {
  std::multimap<Timestamp, int> arrivals;
  for (int i = 0; i < count; ++i) {
    if (const double delay = delay_ms(i); delay >= 0.0) {
      arrivals.emplace(static_cast<Timestamp>((20.0 * i + delay) * kMs), i);
    }
  }
  Played played;
  int last = -1;
  for (Timestamp now = 0; now < (20 * count + 1000) * kMs; now += 20 * kMs) {
    while (!arrivals.empty() && arrivals.begin()->first <= now) {
      const int sequence = arrivals.begin()->second;
      buffer.Push(static_cast<std::uint64_t>(sequence), std::to_string(sequence),
                  arrivals.begin()->first);
      arrivals.erase(arrivals.begin());
    }
    const JitterBuffer::Step step = buffer.Pull();
    if (step.kind == Kind::kMissing) ++played.missing;
    if (step.kind != Kind::kPacket) continue;
    const int sequence = std::stoi(step.opus);
    ++played.packets;
    played.disorder += sequence <= last;
    last = sequence;
    played.worst_wait_ms =
        std::max(played.worst_wait_ms, 1e-6 * static_cast<double>(now) - 20.0 * sequence);
  }
  return played;
}

TEST(JitterBuffer, AnEvenNetworkWaitsLittle) {
  JitterBuffer buffer;
  const Played played = Play(buffer, 500, [](int) { return 30.0; });
  EXPECT_EQ(played.packets, 500);
  EXPECT_EQ(played.disorder, 0);
  EXPECT_LE(played.worst_wait_ms, 100.0);
  EXPECT_DOUBLE_EQ(buffer.delay_ms(), 20.0);
}

TEST(JitterBuffer, AnUnevenOneIsEvenedOutAndInOrder) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> way(20.0, 100.0);
  JitterBuffer buffer;
  const Played played = Play(buffer, 1000, [&](int) { return way(random); });
  EXPECT_EQ(played.disorder, 0);
  EXPECT_GT(played.packets, 950);
  EXPECT_GT(buffer.delay_ms(), 50.0);
  EXPECT_LE(played.worst_wait_ms, 300.0);
}

TEST(JitterBuffer, LostPacketsAreSaidToBeMissing) {
  JitterBuffer buffer;
  const Played played = Play(buffer, 1000, [](int i) { return i % 20 == 7 ? -1.0 : 30.0; });
  EXPECT_GE(played.packets, 945);
  EXPECT_NEAR(played.missing, 50, 8);
}

TEST(JitterBuffer, ASilenceIsNoLoss) {
  JitterBuffer buffer;
  // Half a second of speech, half a second of nothing, in turn.
  const Played played = Play(buffer, 1000, [](int i) { return (i / 25) % 2 == 1 ? -1.0 : 30.0; });
  EXPECT_GE(played.packets, 480);
  EXPECT_LE(played.missing, 20 * 5);
  EXPECT_EQ(played.disorder, 0);
}

TEST(JitterBuffer, WhoeverStallsIsCaughtUpWith) {
  JitterBuffer buffer;
  // After 2 s everything comes 300 ms late at once, and then as before.
  const Played played = Play(
      buffer, 1000, [](int i) { return i >= 100 && i < 115 ? 30.0 + 20.0 * (115 - i) : 30.0; });
  EXPECT_EQ(played.disorder, 0);
  EXPECT_GT(played.packets, 960);
  const Played after = Play(buffer, 0, [](int) { return 0.0; });
  EXPECT_EQ(after.packets, 0);
}

TEST(JitterBuffer, NumbersThatBeginAnewAreHeard) {
  JitterBuffer buffer;
  Play(buffer, 500, [](int) { return 30.0; });
  const Played again = Play(buffer, 100, [](int) { return 30.0; });
  EXPECT_GT(again.packets, 90);
}

TEST(JitterBuffer, ItIsBoundedWhateverIsSent) {
  JitterBuffer buffer;
  for (std::uint64_t i = 0; i < 100'000; ++i) buffer.Push(i * 7919, "x", 0);
  int packets = 0;
  for (int i = 0; i < 1000; ++i) packets += buffer.Pull().kind == Kind::kPacket;
  EXPECT_LE(packets, 24);
}

}  // namespace
}  // namespace saccade::jitter_buffer_test
