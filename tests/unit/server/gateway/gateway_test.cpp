#include "server/gateway/gateway.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <thread>

#include "http_client.hpp"
#include "stream_service.hpp"

namespace saccade::gateway_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

bool Eventually(const std::function<bool()>& holds, milliseconds limit = seconds(5)) {
  const auto end = steady_clock::now() + limit;
  while (!holds()) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return true;
}

class GatewayTest : public ::testing::Test {
 protected:
  void StartWith(GatewayOptions options) {
    options.port = 0;
    auto started = Gateway::Start(options, service_.channel());
    ASSERT_TRUE(started.ok()) << started.status();
    gateway_ = *std::move(started);
  }
  void SetUp() override { StartWith({}); }
  int port() const { return gateway_->port(); }

  StreamService service_;
  std::unique_ptr<Gateway> gateway_;
};

TEST_F(GatewayTest, UnaryCallComesBackWithMessageThenTrailers) {
  HttpClient client(port());
  // Twice on one connection: it is kept.
  for (int i = 0; i < 2; ++i) {
    const HttpReply reply = client.Call("/test.v1.Test/Echo", "hello");
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.headers.at("content-type"), "application/grpc-web+proto");
    EXPECT_FALSE(reply.headers.contains("access-control-allow-origin"));
    const auto frames = SplitFrames(reply.body);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[0].payload, "hello");
    EXPECT_TRUE(frames[1].trailers);
    EXPECT_THAT(frames[1].payload, HasSubstr("grpc-status: 0\r\n"));
    EXPECT_THAT(frames[1].payload, HasSubstr("x-trailer: kept\r\n"));
  }
}

TEST_F(GatewayTest, TextFormatIsBase64BothWays) {
  HttpClient client(port());
  // base64 of {0, 0, 0, 0, 2, 'h', 'i'}
  client.Send(
      "POST /test.v1.Test/Echo HTTP/1.1\r\nHost: localhost\r\n"
      "Content-Type: application/grpc-web-text\r\nContent-Length: 12\r\n\r\nAAAAAAJoaQ==");
  const HttpReply reply = client.ReadReply();
  EXPECT_EQ(reply.headers.at("content-type"), "application/grpc-web-text+proto");
  EXPECT_EQ(reply.body.substr(0, 12), "AAAAAAJoaQ==");
}

TEST_F(GatewayTest, StreamDeliversEveryMessageInOrderThenTrailers) {
  HttpClient client(port());
  const auto frames = SplitFrames(client.Call("/test.v1.Test/Count", "200 3000").body);
  ASSERT_EQ(frames.size(), 201U);
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(frames[i].payload.size(), 3000U);
    EXPECT_EQ(std::stoul(frames[i].payload), i);
  }
  EXPECT_THAT(frames[200].payload, HasSubstr("grpc-status: 0"));
}

TEST_F(GatewayTest, ErrorsKeepCodeAndMessage) {
  HttpClient client(port());
  const auto frames = SplitFrames(client.Call("/test.v1.Test/Fail", "").body);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_THAT(frames[0].payload, HasSubstr("grpc-status: 9\r\n"));
  EXPECT_THAT(frames[0].payload, HasSubstr("grpc-message: no map yet%0A100 %25\r\n"));
}

TEST_F(GatewayTest, DeadlineEndsTheCall) {
  HttpClient client(port());
  const auto start = steady_clock::now();
  const auto frames =
      SplitFrames(client.Call("/test.v1.Test/Silent", "", "grpc-timeout: 200m\r\n").body);
  EXPECT_LT(steady_clock::now() - start, seconds(3));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_THAT(frames[0].payload, HasSubstr("grpc-status: 4\r\n"));
}

TEST_F(GatewayTest, LeavingBrowserCancelsItsCall) {
  HttpClient silent(port());
  silent.SendCall("/test.v1.Test/Silent", "");
  HttpClient streaming(port());
  streaming.SendCall("/test.v1.Test/Count", "1000000000 1000");
  ASSERT_TRUE(
      Eventually([&] { return service_.open_calls == 2 && service_.messages_written > 9; }));
  silent.Close();
  streaming.Close();
  EXPECT_TRUE(Eventually([&] { return service_.open_calls == 0; }));
}

// One byte more than the request hid the end of the connection.
TEST_F(GatewayTest, LeavingIsSeenBehindBytesSentTooMuch) {
  HttpClient ghost(port());
  ghost.SendCall("/test.v1.Test/Silent", "");
  ASSERT_TRUE(Eventually([&] { return service_.open_calls == 1; }));
  ghost.Send("x");
  std::this_thread::sleep_for(milliseconds(50));
  ghost.Close();
  EXPECT_TRUE(Eventually([&] { return service_.open_calls == 0; }));
}

TEST_F(GatewayTest, PipelinedRequestsAreAnsweredInOrder) {
  HttpClient client(port());
  for (int i = 0; i < 200; ++i) client.SendCall("/test.v1.Test/Echo", std::to_string(i));
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(SplitFrames(client.ReadReply().body)[0].payload, std::to_string(i));
  }
}

TEST_F(GatewayTest, AnEndlessPipelineBehindAStreamEndsIt) {
  HttpClient client(port());
  client.SendCall("/test.v1.Test/Silent", "");
  ASSERT_TRUE(Eventually([&] { return service_.open_calls == 1; }));
  client.Send(std::string(1 << 20, 'x'));
  EXPECT_TRUE(Eventually([&] { return service_.open_calls == 0; }));
}

TEST_F(GatewayTest, SlowBrowserHoldsTheStreamInsteadOfFillingMemory) {
  HttpClient client(port(), 4096);
  client.SendCall("/test.v1.Test/Count", "1000 100000");
  // The kernel's buffers take a few; then nothing more is asked of the service.
  ASSERT_TRUE(Eventually([&] { return service_.messages_written > 0; }));
  std::this_thread::sleep_for(milliseconds(500));
  const int held_at = service_.messages_written;
  EXPECT_LT(held_at, 100);
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(service_.messages_written, held_at);
  const auto frames = SplitFrames(client.ReadReply().body);
  EXPECT_EQ(frames.size(), 1001U);
}

TEST_F(GatewayTest, StalledBrowserIsDroppedAfterTheWriteTimeout) {
  GatewayOptions options;
  options.write_timeout = milliseconds(300);
  StartWith(options);
  HttpClient client(port(), 4096);
  client.SendCall("/test.v1.Test/Count", "1000 100000");
  ASSERT_TRUE(Eventually([&] { return service_.open_calls == 1; }));
  EXPECT_TRUE(Eventually([&] { return service_.open_calls == 0; }));
}

TEST_F(GatewayTest, OversizedRequestIsRefusedWithItsReason) {
  GatewayOptions options;
  options.max_request_bytes = 1000;
  StartWith(options);
  HttpClient client(port());
  const HttpReply reply = client.Call("/test.v1.Test/Echo", std::string(5000, 'x'));
  const auto frames = SplitFrames(reply.body);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_THAT(frames[0].payload, HasSubstr("grpc-status: 8\r\n"));
  EXPECT_EQ(service_.messages_written, 0);
}

TEST_F(GatewayTest, MalformedRequestsGetAStatusAndNoCall) {
  for (const std::string body : {"", "abc", "\x01\x01\x01\x01\x01"}) {
    HttpClient client(port());
    client.Send(
        "POST /test.v1.Test/Echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
        "application/grpc-web+proto\r\nContent-Length: " +
        std::to_string(body.size()) + "\r\n\r\n" + body);
    const auto frames = SplitFrames(client.ReadReply().body);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_THAT(frames[0].payload, ::testing::AnyOf(HasSubstr("grpc-status: 3\r\n"),
                                                    HasSubstr("grpc-status: 12\r\n")));
  }
  HttpClient garbage(port());
  garbage.Send("\x16\x03\x01 this is not HTTP\r\n\r\n");
  EXPECT_EQ(garbage.ReadReply().status, 400);
  EXPECT_TRUE(garbage.ClosedWithin(seconds(3)));
}

// A byte that metadata may not hold used to abort the server (gRPC's assertion).
TEST_F(GatewayTest, ForwardedHeadersWithBytesThatMetadataMayNotHoldAreRefused) {
  for (const std::string name : {"authorization", "traceparent", "tracestate", "x-request-id"}) {
    for (const std::string value : {"a\tb", "a\x01z", "a\x7fz", "a\x80z", "\xff"}) {
      HttpClient client(port());
      client.SendCall("/test.v1.Test/Echo", "hi", name + ": " + value + "\r\n");
      EXPECT_EQ(client.ReadReply().status, 400) << name;
    }
    HttpClient client(port());
    EXPECT_EQ(client.Call("/test.v1.Test/Echo", "hi", name + ": fine ~!\r\n").status, 200);
  }
}

std::string ChunkedHead() {
  return "POST /test.v1.Test/Echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
         "application/grpc-web+proto\r\nTransfer-Encoding: chunked\r\n\r\n";
}

TEST_F(GatewayTest, ChunkedRequestsAreTaken) {
  HttpClient client(port());
  client.Send(ChunkedHead());
  for (const char byte : std::string("\0\0\0\0\x02hi", 7)) {
    client.Send(std::string("1;note=small\r\n") + byte + "\r\n");
  }
  client.Send("0\r\nX-Trailer: kept to itself\r\n\r\n");
  EXPECT_EQ(SplitFrames(client.ReadReply().body)[0].payload, "hi");
}

// 64 KiB in one trailer used to throw through the gateway's thread.
TEST_F(GatewayTest, TrailersAndChunkHeadsHaveTheHeadsLimit) {
  const std::string endless(1 << 16, 'x');
  for (const auto& rest : std::vector<std::string>{"0\r\nX: " + endless + "\r\n\r\n",
                                                   "1;" + endless, "0\r\n" + endless, endless}) {
    HttpClient client(port());
    client.Send(ChunkedHead() + rest);
    const int status = client.ReadReply().status;
    EXPECT_TRUE(status == 431 || status == 400) << status;
    EXPECT_TRUE(client.ClosedWithin(seconds(5)));
  }
  EXPECT_EQ(HttpClient(port()).Get("/").status, 200);
}

TEST_F(GatewayTest, ForeignHostsOriginsAndMethodsAreRefused) {
  HttpClient client(port());
  client.Send("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(client.ReadReply().status, 421);
  EXPECT_EQ(client.Call("/test.v1.Test/Echo", "", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(client.Call("/test.v1.Test/Echo", "", "Origin: http://localhost\r\n").status, 200);
  EXPECT_EQ(client.Call("/index.html", "").status, 404);
  client.Send("OPTIONS /test.v1.Test/Echo HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.ReadReply().status, 405);
}

TEST_F(GatewayTest, FilesComeWithSecurityHeadersAndRevalidate) {
  HttpClient client(port());
  const HttpReply page = client.Get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.body, HasSubstr("npm run build"));
  EXPECT_THAT(page.headers.at("content-security-policy"), HasSubstr("default-src 'none'"));
  EXPECT_THAT(page.headers.at("content-security-policy"),
              HasSubstr("script-src 'self' 'wasm-unsafe-eval';"));
  EXPECT_EQ(page.headers.at("x-content-type-options"), "nosniff");
  const std::string tag = "If-None-Match: " + page.headers.at("etag") + "\r\n";
  EXPECT_EQ(client.Get("/", tag).status, 304);
  EXPECT_EQ(client.Get("/nothing").status, 404);
  EXPECT_EQ(client.Get("/../../etc/passwd").status, 404);
}

TEST_F(GatewayTest, StopEndsStreamsPromptly) {
  HttpClient silent(port());
  silent.SendCall("/test.v1.Test/Silent", "");
  HttpClient stalled(port(), 4096);
  stalled.SendCall("/test.v1.Test/Count", "1000 100000");
  ASSERT_TRUE(Eventually([&] { return service_.open_calls == 2; }));
  const auto start = steady_clock::now();
  gateway_->Stop();
  EXPECT_LT(steady_clock::now() - start, seconds(1));
  EXPECT_TRUE(Eventually([&] { return service_.open_calls == 0; }));
}

TEST_F(GatewayTest, AtTheLimitWhoeverIsIdleLongestGivesWay) {
  GatewayOptions options;
  options.connections.all = 2;
  StartWith(options);
  HttpClient first(port());
  HttpClient second(port());
  EXPECT_EQ(first.Get("/").status, 200);
  EXPECT_EQ(second.Get("/").status, 200);
  HttpClient third(port());
  EXPECT_EQ(third.Get("/").status, 200);
  EXPECT_TRUE(first.ClosedWithin(seconds(3)));
  EXPECT_EQ(second.Get("/").status, 200);
}

TEST_F(GatewayTest, AtTheLimitWhoIsBeingAnsweredStays) {
  GatewayOptions options;
  options.connections.all = 2;
  StartWith(options);
  HttpClient first(port());
  first.SendCall("/test.v1.Test/Silent", "");
  HttpClient second(port());
  second.SendCall("/test.v1.Test/Silent", "");
  ASSERT_TRUE(Eventually([&] { return service_.open_calls == 2; }));
  HttpClient third(port());
  EXPECT_TRUE(third.ClosedWithin(seconds(3)));
  EXPECT_EQ(service_.open_calls, 2);
}

TEST(GatewayStart, BadOptionsAndTakenPortsAreNamed) {
  StreamService service;
  GatewayOptions options;
  options.host = "nonsense";
  EXPECT_THAT(std::string(Gateway::Start(options, service.channel()).status().message()),
              HasSubstr("gateway.host"));
  options = {};
  options.port = 0;
  auto first = Gateway::Start(options, service.channel());
  ASSERT_TRUE(first.ok());
  options.port = (*first)->port();
  const absl::Status taken = Gateway::Start(options, service.channel()).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(taken.message()), HasSubstr("--http"));
}

}  // namespace
}  // namespace saccade::gateway_test
