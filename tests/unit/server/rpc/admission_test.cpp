#include "server/rpc/admission.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "server/pipeline/busy.hpp"

namespace saccade::admission_test {
namespace {

constexpr Timestamp kSecond = 1'000'000'000;

TEST(RateLimiter, GivesABurstThenItsRateAndSaysHowLongToWait) {
  RateLimiter limiter({.per_s = 10, .burst = 5});
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(limiter.Take("a", 0).has_value());
  const auto wait_ns = limiter.Take("a", 0);
  ASSERT_TRUE(wait_ns.has_value());
  EXPECT_EQ(*wait_ns, kSecond / 10);
  EXPECT_TRUE(limiter.Take("a", *wait_ns - 1'000'000).has_value());
  EXPECT_FALSE(limiter.Take("a", *wait_ns + 1).has_value());
  EXPECT_FALSE(limiter.Take("b", 0).has_value()) << "another key has its own";
  int granted = 0;
  for (Timestamp ms = 0; ms < 10'000; ++ms) {
    granted += !limiter.Take("a", kSecond + ms * 1'000'000).has_value();
  }
  EXPECT_NEAR(granted, 105, 2);
}

TEST(RateLimiter, WhatIsLargerThanABurstIsPaidOffAfterwards) {
  RateLimiter limiter({.per_s = 1000, .burst = 4000});
  EXPECT_FALSE(limiter.Take("a", 0, 10'000).has_value()) << "else it would never be";
  const auto wait_ns = limiter.Take("a", 0, 1000);
  ASSERT_TRUE(wait_ns.has_value());
  EXPECT_EQ(*wait_ns, 7 * kSecond);
  EXPECT_TRUE(limiter.Take("a", 6 * kSecond, 1000).has_value());
  EXPECT_FALSE(limiter.Take("a", 7 * kSecond, 1000).has_value());
}

TEST(RateLimiter, NoLimitIsNone) {
  RateLimiter limiter({});
  for (int i = 0; i < 10'000; ++i) ASSERT_FALSE(limiter.Take("a", 0).has_value());
  EXPECT_EQ(limiter.size(), 0u);
}

TEST(RateLimiter, ManyKeysAreBounded) {
  RateLimiter limiter({.per_s = 1, .burst = 2}, 100);
  for (int i = 0; i < 100'000; ++i) limiter.Take(std::to_string(i), i * 1'000);
  EXPECT_LE(limiter.size(), 101u);
  // Once the others have rested, a new one has a bucket of its own again.
  EXPECT_FALSE(limiter.Take("new", 100 * kSecond).has_value());
}

TEST(Admission, WhoFloodsFromAnAddressDoesNotSilenceTheOthersThere) {
  Admission admission({});
  int granted = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::string session = "flood" + std::to_string(i % 50);
    granted += admission.Participant(Toll::kEdit, session, "ipv4:127.0.0.1", i * 50'000).ok();
  }
  EXPECT_LT(granted, 4000) << "of 20000 in a second";
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(admission.Participant(Toll::kEdit, "good", "ipv4:127.0.0.1", kSecond + i).ok());
  }
}

TEST(Admission, ARefusalSaysWhoseLimitItIsAndWhenToTryAgain) {
  Admission admission({});
  absl::Status last;
  for (int i = 0; i < 10; ++i) last = admission.Participant(Toll::kReset, "s", "p", 0);
  EXPECT_EQ(last.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(last.message(), "too many resets of the map from this session: try again in 5.0 s");
  // google.rpc.RetryInfo { retry_delay { seconds: 5 nanos: 0 } }
  EXPECT_EQ(RetryInfoOf(last), std::string("\x0a\x04\x08\x05\x10\x00", 6));
  EXPECT_EQ(RetryInfoOf(absl::ResourceExhaustedError("full")), std::nullopt);
}

TEST(Admission, JoinsAreLimitedByAddressAndInAll) {
  Admission admission({});
  int one = 0, many = 0;
  for (int i = 0; i < 5000; ++i) one += admission.Anyone(Toll::kJoin, "p", 0).ok();
  EXPECT_EQ(one, 1000);
  for (int i = 0; i < 5000; ++i) {
    many += admission.Anyone(Toll::kJoin, "p" + std::to_string(i), kSecond).ok();
  }
  EXPECT_EQ(many, 50);
}

}  // namespace
}  // namespace saccade::admission_test
