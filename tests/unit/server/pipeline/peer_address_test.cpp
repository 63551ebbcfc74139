#include "server/pipeline/peer_address.hpp"

#include <gtest/gtest.h>

namespace saccade::peer_address_test {
namespace {

TEST(PeerAddress, AHouseholdIsOneCallerAndAMappedAddressIsItself) {
  EXPECT_EQ(PeerKey("192.0.2.7"), "ipv4:192.0.2.7");
  EXPECT_EQ(PeerKey("::ffff:192.0.2.7"), "ipv4:192.0.2.7");
  EXPECT_EQ(PeerKey("2001:db8:0:1::5"), PeerKey("2001:db8:0:1:ffff::9"));
  EXPECT_NE(PeerKey("2001:db8:0:1::5"), PeerKey("2001:db8:0:2::5"));
}

TEST(PeerAddress, IsWrittenInOneWay) {
  EXPECT_EQ(PlainAddress("2001:DB8:0::5"), "2001:db8::5");
  EXPECT_EQ(PlainAddress("::ffff:10.0.0.1"), "10.0.0.1");
  EXPECT_EQ(PlainAddress("::FFFF:a00:1"), "10.0.0.1");
  EXPECT_EQ(PlainAddress("fe80::1%eth0"), "fe80::1");
  EXPECT_EQ(PeerKey("fe80::1%eth0"), PeerKey("fe80::2%eth0")) << "one link, one caller";
  EXPECT_EQ(PlainAddress(""), "");
}

TEST(PeerAddress, ThisMachineIsLoopbackAndNothingElse) {
  for (const char* own : {"127.0.0.1", "127.1.2.3", "::1"})
    EXPECT_TRUE(IsThisMachine(PeerKey(own)));
  for (const char* other : {"128.0.0.1", "10.127.0.1", "::2", "2001:db8::1"}) {
    EXPECT_FALSE(IsThisMachine(PeerKey(other))) << other;
  }
}

TEST(PeerAddress, OfForwardedForOnlyWhatTheProxyWroteCounts) {
  EXPECT_EQ(ForwardedFor("203.0.113.7"), "203.0.113.7");
  EXPECT_EQ(ForwardedFor("127.0.0.1, 10.0.0.1,  203.0.113.7 "), "203.0.113.7");
  EXPECT_EQ(ForwardedFor("203.0.113.7:41000"), "203.0.113.7");
  EXPECT_EQ(ForwardedFor("[2001:db8::1]:41000"), "2001:db8::1");
  EXPECT_EQ(ForwardedFor("2001:db8::1"), "2001:db8::1");
  for (const char* bad : {"", "unknown", "203.0.113.7, _hidden", "203.0.113.7,", "300.1.1.1"}) {
    EXPECT_EQ(ForwardedFor(bad), "") << bad;
  }
}

TEST(PeerAddress, NeighboursAreOneNetwork) {
  const auto network = [](const char* address) { return NetworkKey(PeerKey(address)); };
  EXPECT_EQ(network("203.0.113.7"), network("203.0.113.250"));
  EXPECT_NE(network("203.0.113.7"), network("203.0.114.7"));
  EXPECT_EQ(network("2001:db8:1:2::5"), network("2001:db8:1:ffff::9"));
  EXPECT_NE(network("2001:db8:1:2::5"), network("2001:db8:2:2::5"));
}

TEST(PeerAddress, ATokenStandsBehindBearer) {
  EXPECT_EQ(TokenIn("Bearer p1.secret"), "p1.secret");
  EXPECT_EQ(TokenIn("bearer  p1.secret "), "p1.secret");
  EXPECT_EQ(TokenIn("Basic abc"), "Basic abc");
}

}  // namespace
}  // namespace saccade::peer_address_test
