// Behind a reverse proxy everybody has one address, but for what it says of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::proxy_test {
namespace {

using ::testing::HasSubstr;

HttpsReply PageFor(const GuardedServer& server, const std::string& forwarded_for) {
  HttpsRequest request;
  request.port = server.http_port();
  request.root_pem = server.root_pem();
  if (!forwarded_for.empty()) request.headers = "X-Forwarded-For: " + forwarded_for + "\r\n";
  return Send(request);
}

int GetAccessFor(const GuardedServer& server, const std::string& forwarded_for) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
  context.AddMetadata("x-forwarded-for", forwarded_for);
  v1::GetAccessResponse response;
  return v1::AccessService::NewStub(server.channel())
      ->GetAccess(&context, {}, &response)
      .error_code();
}

TEST(TrustedProxy, EachWhomItBringsHasLimitsOfTheirOwn) {
  GuardedServer server(
      {.limits = "address_requests_per_s = 0.01\n", .top = "trusted_proxy = \"127.0.0.1\"\n"});
  EXPECT_EQ(PageFor(server, "203.0.113.7").http_status, 200);
  const HttpsReply often = PageFor(server, "203.0.113.7");
  EXPECT_EQ(often.http_status, 429);
  EXPECT_THAT(often.head, HasSubstr("Retry-After: "));
  EXPECT_EQ(PageFor(server, "203.0.113.8").http_status, 200) << "somebody else";
  EXPECT_EQ(PageFor(server, "203.0.113.99, 203.0.113.7").http_status, 429)
      << "what the proxy did not write itself is anybody's";
  EXPECT_EQ(PageFor(server, "127.0.0.1\r\nX-Forwarded-For: 203.0.113.7").http_status, 429)
      << "nor is a line before the proxy's";
  for (int i = 0; i < 5; ++i) EXPECT_EQ(PageFor(server, "").http_status, 200) << "the proxy itself";
  EXPECT_EQ(GetAccessFor(server, "203.0.113.9"), 0);
  EXPECT_EQ(GetAccessFor(server, "203.0.113.9"), 8);
  EXPECT_EQ(GetAccessFor(server, "203.0.113.8"), 8) << "both ports have one bucket";
}

TEST(TrustedProxy, NobodyElseMaySayWhoTheyAre) {
  GuardedServer server({.limits = "this_machine = true\naddress_requests_per_s = 0.5\n"});
  int refused = 0;
  for (int i = 0; i < 12; ++i) {
    refused += PageFor(server, "203.0.113." + std::to_string(i)).http_status == 429;
  }
  EXPECT_GE(refused, 4) << "another name each time, one address";
}

TEST(TrustedProxy, IsOneMachine) {
  const RunResult run =
      RunProgram({SACCADE_SERVER_PROGRAM, "--source", "sim:desk", "--trusted-proxy", "10.0.0.0/8"},
                 std::chrono::seconds(20));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--trusted-proxy: '10.0.0.0/8' is no address"));
}

}  // namespace
}  // namespace saccade::testing::proxy_test
