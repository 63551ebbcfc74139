#include "server/gateway/host_check.hpp"

#include <gtest/gtest.h>

namespace saccade::host_check_test {
namespace {

TEST(HostCheck, ForeignNamesAreRefused) {
  const HostCheck check({"Wearable.example"});
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:8080", "[::1]:8080", "[::1]",
                           "192.168.1.7:80", "LOCALHOST", "wearable.example:8080"}) {
    EXPECT_TRUE(check.HostAllowed(host)) << host;
  }
  for (const char* host : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example",
                           ":8080", "[::1", "evil.example:127.0.0.1", "localhost:@evil.example",
                           "localhost:80x", "[::1]evil.example"}) {
    EXPECT_FALSE(check.HostAllowed(host)) << host;
  }
}

TEST(HostCheck, OnlyOurOwnPagesMayCall) {
  EXPECT_TRUE(HostCheck::OriginAllowed("", "localhost:8080"));
  EXPECT_TRUE(HostCheck::OriginAllowed("http://localhost:8080", "localhost:8080"));
  EXPECT_TRUE(HostCheck::OriginAllowed("https://localhost:8080", "localhost:8080"));
  EXPECT_FALSE(HostCheck::OriginAllowed("http://localhost:9090", "localhost:8080"));
  EXPECT_FALSE(HostCheck::OriginAllowed("http://evil.example", "localhost:8080"));
  EXPECT_FALSE(HostCheck::OriginAllowed("null", "localhost:8080"));
}

}  // namespace
}  // namespace saccade::host_check_test
