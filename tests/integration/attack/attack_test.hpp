#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "tests/integration/attack/attacks.hpp"
#include "tests/integration/attack/good_expert.hpp"

namespace saccade::testing {

/// A server with a good expert at work on it. Whatever a test does: at its end the server is alive
/// and answers, and the expert has placed ten marks and lost nothing.
class AttackTest : public ::testing::Test {
 protected:
  void SetUp() override { Begin({}); }
  void TearDown() override;
  void Begin(const TargetOptions& options);

  /// Runs `attack` beside the expert, on a thread that gives way; returns when it is over.
  void Run(milliseconds span, const std::function<void(const Battle&)>& attack);
  /// Sends each and demands that the server lives and that the answer is one of those wanted.
  void SendAll(const std::vector<HttpCase>& cases);
  /// Waits until the server's own buffers (10 s of pictures) are full, so that what comes after is
  /// the attack's doing; KiB held then.
  long SteadyMemory();
  /// Participants in the server's own words; -1: no answer.
  int Participants();
  /// True if they are `count` before `limit` is over.
  bool WaitForParticipants(int count, milliseconds limit);

  static constexpr std::uint32_t kSeed = 20261128;
  static constexpr int kMarks = 10;
  Tally tally_;
  std::unique_ptr<Target> target_;
  std::unique_ptr<GoodExpert> expert_;
};

}  // namespace saccade::testing
