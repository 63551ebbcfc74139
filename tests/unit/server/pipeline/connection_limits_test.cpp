#include "server/pipeline/connection_limits.hpp"

#include <gtest/gtest.h>

#include "server/pipeline/busy.hpp"

namespace saccade::connection_limits_test {
namespace {

constexpr Timestamp kSecond = 1'000'000'000;
const ConnectionLimits kLimits{.of_address = 4,
                               .of_network = 6,
                               .unheard_of_address = 2,
                               .new_of_address = {1, 3},
                               .trusted_proxy = "192.0.2.1"};

TEST(ConnectionGate, AnAddressHasItsShareAndHearsWhenToComeAgain) {
  ConnectionGate gate(kLimits);
  const std::string peer = "ipv4:192.0.2.7";
  EXPECT_TRUE(gate.Admit(peer, {1000, 3, 1}).ok());
  for (const ConnectionCounts& full :
       {ConnectionCounts{4, 4, 0}, ConnectionCounts{3, 3, 2}, ConnectionCounts{9, 3, 0, 6}}) {
    const absl::Status status = gate.Admit(peer, full);
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_GT(RetryAfterOf(status), 0);
  }
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(gate.Hurry(peer, 0).ok());
  const absl::Status hurried = gate.Hurry(peer, 0);
  EXPECT_EQ(RetryAfterOf(hurried), kSecond);
  EXPECT_TRUE(gate.Hurry("ipv4:192.0.2.8", 0).ok()) << "another's is another's";
  EXPECT_TRUE(gate.Hurry(peer, kSecond).ok());
}

TEST(ConnectionGate, TheProxyAndThisMachineBringOthers) {
  ConnectionGate gate(kLimits);
  const std::string own = "ipv4:127.0.0.1";
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(gate.Hurry(own, 0).ok());
  EXPECT_TRUE(gate.Admit(own, {500, 500, 500}).ok());
  EXPECT_TRUE(gate.IsProxy("192.0.2.1"));
  EXPECT_TRUE(gate.IsProxy("::ffff:192.0.2.1")) << "the same, by a socket for both";
  EXPECT_FALSE(gate.IsProxy("192.0.2.2"));
  EXPECT_FALSE(ConnectionGate(ConnectionLimits()).IsProxy("")) << "nobody is the proxy";
  ConnectionLimits strict = kLimits;
  strict.this_machine = true;
  EXPECT_FALSE(ConnectionGate(strict).Admit("ipv4:127.0.0.1", {500, 500, 500}).ok());
}

}  // namespace
}  // namespace saccade::connection_limits_test
