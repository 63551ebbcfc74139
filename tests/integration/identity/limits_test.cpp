// What one caller may ask for, on both ports, before anything of it is parsed.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "saccade/v1/annotation.grpc.pb.h"
#include "server/identity/role_table.hpp"
#include "tests/integration/attack/socket.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::limits_test {
namespace {

using ::testing::HasSubstr;

constexpr int kResourceExhausted = 8, kUnauthenticated = 16, kUnimplemented = 12;
const std::string kNonsense = "\xff\xff\xff\xff";  // of no message a valid encoding

std::string FullName(absl::string_view row) {
  return absl::StrCat(absl::StartsWith(row, "Health/") ? "grpc.health.v1." : "saccade.v1.", row);
}

// Nonsense that is parsed has another answer.
TEST(Limits, EveryMethodIsRefusedBeforeItsMessageIsParsed) {
  GuardedServer server({.limits = "requests_per_s = 0.01\n"});
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_WEARER);
  const std::string ping = "saccade.v1.SessionService/Ping";
  EXPECT_EQ(server.Call(ping, "", pass).code, 0) << "the first is served";
  int methods = 0;
  for (const RoleRow& row : RoleTable()) {
    if (absl::StartsWith(row.what, "GET ")) continue;
    ++methods;
    // gRPC reads this one's message itself, before anybody is asked; it is one text.
    const std::string message = row.what == "Health/Watch" ? "" : kNonsense;
    const Outcome grpc = server.Call(FullName(row.what), message, pass);
    EXPECT_EQ(grpc.code, kResourceExhausted) << row.what << ": " << grpc.message;
    EXPECT_THAT(grpc.message, HasSubstr("more than 0.01 calls a second with this pass: try again"));
    const HttpsReply web =
        CallOverWeb(server.http_port(), server.root_pem(), FullName(row.what), kNonsense, pass);
    EXPECT_EQ(web.grpc_status, kResourceExhausted) << row.what << ": " << web.head;
    EXPECT_THAT(web.head, HasSubstr("Retry-After: ")) << row.what;
  }
  EXPECT_GE(methods, 36);
  HttpsRequest page;
  page.port = server.http_port();
  page.root_pem = server.root_pem();
  page.token = pass;
  const HttpsReply refused = Send(page);
  EXPECT_EQ(refused.http_status, 429);
  EXPECT_THAT(refused.head, HasSubstr("Retry-After: "));
  EXPECT_THAT(refused.body, HasSubstr("0.01 calls a second with this pass: try again in"));
  // Nobody else pays for it.
  EXPECT_EQ(server.Call("saccade.v1.AccessService/GetAccess", "", "").code, 0);
  page.token.clear();
  EXPECT_EQ(Send(page).http_status, 200);
}

TEST(Limits, BytesCountAsWell) {
  GuardedServer server({.limits = "bytes_per_s = 1000\n"});
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_WEARER);
  const std::string ping = "saccade.v1.SessionService/Ping";
  EXPECT_NE(server.Call(ping, std::string(100'000, '\xff'), pass).code, kResourceExhausted);
  const Outcome next = server.Call(ping, "", pass);
  EXPECT_EQ(next.code, kResourceExhausted);
  EXPECT_THAT(next.message, HasSubstr("more than 1000 bytes a second with this pass"));
  EXPECT_EQ(server.Call(ping, "", server.owner_token()).code, 0);
}

TEST(Limits, WhoHasNoPassPaysAsAnAddress) {
  GuardedServer server({.limits = "this_machine = true\naddress_requests_per_s = 0.1\n"});
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_VIEWER);
  const std::string method = "saccade.v1.AccessService/GetAccess";
  Outcome last{0, ""};
  for (int i = 0; i < 20 && last.code == 0; ++i) last = server.Call(method, "", "");
  EXPECT_EQ(last.code, kResourceExhausted);
  EXPECT_THAT(last.message, HasSubstr("more than 0.1 calls a second from this address"));
  HttpsRequest request;
  request.port = server.http_port();
  request.root_pem = server.root_pem();
  const HttpsReply page = Send(request);
  EXPECT_EQ(page.http_status, 429) << "both ports have one bucket";
  // A forged token is no pass.
  EXPECT_EQ(server.Call(method, "", "p000000000000." + std::string(43, 'A')).code,
            kResourceExhausted);
  EXPECT_EQ(server.Call(method, "", pass).code, 0) << "who was let in is not silenced";
}

TEST(Limits, SessionsOfOnePass) {
  GuardedServer server({.limits = "sessions = 3\n"});
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_PILOT);
  for (int i = 0; i < 3; ++i) server.Join(pass);
  const Outcome fourth = server.Call("saccade.v1.SessionService/Join", "", pass);
  EXPECT_EQ(fourth.code, kResourceExhausted);
  EXPECT_THAT(fourth.message, HasSubstr("3 of this invite are in use"));
  EXPECT_FALSE(server.Join(server.PassOf(v1::ACCESS_ROLE_PILOT)).empty());
}

// A link that is redeemed many times has no more than a room full of people.
TEST(Limits, OfEverybodyWhoCameByOneInvite) {
  GuardedServer server({.limits = "invite_requests_per_s = 0.01\ninvite_sessions = 3\n"});
  const std::string invite = server.Invite(v1::ACCESS_ROLE_PILOT, nullptr, 3);
  std::string first, second;
  ASSERT_EQ(server.Redeem(invite, &first).code, 0);
  ASSERT_EQ(server.Redeem(invite, &second).code, 0);
  const std::string ping = "saccade.v1.SessionService/Ping";
  EXPECT_EQ(server.Call(ping, "", first).code, 0);
  for (const std::string& pass : {first, second}) {
    const Outcome refused = server.Call(ping, "", pass);
    EXPECT_EQ(refused.code, kResourceExhausted);
    EXPECT_THAT(refused.message,
                HasSubstr("more than 0.01 calls a second by everybody with this invite: try"));
    const HttpsReply web = CallOverWeb(server.http_port(), server.root_pem(), ping, "", pass);
    EXPECT_EQ(web.grpc_status, kResourceExhausted);
  }
  EXPECT_EQ(server.Call(ping, "", server.PassOf(v1::ACCESS_ROLE_PILOT)).code, 0)
      << "another invite";
}

TEST(Limits, BytesAndSessionsOfEverybodyWhoCameByOneInvite) {
  GuardedServer server({.limits = "invite_bytes_per_s = 1000\ninvite_sessions = 3\n"});
  const std::string invite = server.Invite(v1::ACCESS_ROLE_PILOT, nullptr, 4);
  std::string passes[4];
  for (std::string& pass : passes) ASSERT_EQ(server.Redeem(invite, &pass).code, 0);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(server.Join(passes[i]).empty());
  const Outcome fourth = server.Call("saccade.v1.SessionService/Join", "", passes[3]);
  EXPECT_EQ(fourth.code, kResourceExhausted);
  EXPECT_THAT(fourth.message, HasSubstr("3 of this invite are in use"));
  EXPECT_FALSE(server.Join(server.PassOf(v1::ACCESS_ROLE_PILOT)).empty());
  const std::string ping = "saccade.v1.SessionService/Ping";
  EXPECT_NE(server.Call(ping, std::string(100'000, '\xff'), passes[0]).code, kResourceExhausted);
  EXPECT_THAT(server.Call(ping, "", passes[1]).message,
              HasSubstr("more than 1000 bytes a second by everybody with this invite"));
}

TEST(Limits, AnnotationsOfOneSession) {
  GuardedServer server({.limits = "session_annotations = 2\n"});
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_ANNOTATOR);
  v1::CreateAnnotationRequest request;
  request.set_session_id(server.Join(pass));
  request.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_NOTE);
  request.mutable_draft()->set_text("note");
  request.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_x(0.1);
  Outcome last{0, ""};
  int made = 0;
  for (int tries = 0; tries < 300 && made < 3 && last.code != kResourceExhausted; ++tries) {
    request.set_request_id(absl::StrFormat("00000000-0000-4000-8000-%012d", tries));
    last = server.Call("saccade.v1.AnnotationService/Create", request.SerializeAsString(), pass);
    made += last.code == 0;
    if (last.code != 0) std::this_thread::sleep_for(milliseconds(100));  // no picture yet
  }
  EXPECT_EQ(made, 2);
  EXPECT_EQ(last.code, kResourceExhausted) << last.message;
}

/// How many of `count` silent connections are still open after a moment.
int OpenOf(std::deque<Socket>& sockets, int port, int count) {
  for (int i = 0; i < count; ++i) {
    sockets.emplace_back(port);
    sockets.back().Send("\x16");  // as a handshake begins
  }
  std::this_thread::sleep_for(milliseconds(500));
  int open = 0;
  for (Socket& socket : sockets) open += socket.ok() && !socket.ClosedByPeer(milliseconds(1));
  return open;
}

TEST(Limits, HalfOpenConnectionsOfOneAddress) {
  GuardedServer server({.limits = "this_machine = true\naddress_unheard = 6\n"});
  for (const int port : {server.grpc_port(), server.http_port()}) {
    std::deque<Socket> sockets;
    EXPECT_EQ(OpenOf(sockets, port, 12), 6) << port;
    sockets.clear();
    std::this_thread::sleep_for(milliseconds(300));
    EXPECT_EQ(OpenOf(sockets, port, 3), 3) << "those that went count no more";
  }
}

TEST(Limits, ConnectionsOfOneAddressAndHowOftenItMakesThem) {
  GuardedServer many({.limits = "this_machine = true\naddress_connections = 5\n"});
  std::deque<Socket> sockets;
  EXPECT_EQ(OpenOf(sockets, many.http_port(), 10), 5);
  std::deque<Socket> others;
  EXPECT_LE(OpenOf(others, many.grpc_port(), 10), 5);
  GuardedServer often({.limits = "this_machine = true\naddress_connections_per_s = 1\n"});
  std::deque<Socket> quick;
  EXPECT_LE(OpenOf(quick, often.http_port(), 20), 8) << "six seconds' worth at once";
}

/// One Health/Watch, and what came of it.
struct HealthWatch {
  HealthWatch(const std::shared_ptr<grpc::Channel>& channel, const std::string& pass) {
    context.AddMetadata("authorization", "Bearer " + pass);
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    stub = grpc::health::v1::Health::NewStub(channel);
    reader = stub->Watch(&context, {});
    serving = reader->Read(&response) && response.status() == response.SERVING;
  }
  /// Waits for its end.
  grpc::Status End() {
    while (reader->Read(&response)) {
    }
    return reader->Finish();
  }
  grpc::ClientContext context;
  std::unique_ptr<grpc::health::v1::Health::Stub> stub;
  std::unique_ptr<grpc::ClientReader<grpc::health::v1::HealthCheckResponse>> reader;
  grpc::health::v1::HealthCheckResponse response;
  bool serving = false;
};

TEST(Health, WatchIsForFourOfAPassAndEndsWithIt) {
  GuardedServer server;
  std::string invite_id;
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_VIEWER, &invite_id);
  std::deque<HealthWatch> watches;
  for (int i = 0; i < 4; ++i) {
    watches.emplace_back(server.channel(), pass);
    EXPECT_TRUE(watches.back().serving) << i;
  }
  HealthWatch fifth(server.channel(), pass);
  EXPECT_FALSE(fifth.serving);
  const grpc::Status refused = fifth.End();
  EXPECT_EQ(refused.error_code(), kResourceExhausted);
  EXPECT_THAT(refused.error_message(), HasSubstr("you watch four times already"));
  HealthWatch other(server.channel(), server.PassOf(v1::ACCESS_ROLE_VIEWER));
  EXPECT_TRUE(other.serving) << "nobody else's";

  // One that goes makes room.
  watches.front().context.TryCancel();
  watches.front().End();
  watches.pop_front();
  bool again = false;
  for (int tries = 0; tries < 50 && !again; ++tries) {
    std::this_thread::sleep_for(milliseconds(20));
    HealthWatch probe(server.channel(), pass);
    again = probe.serving;
    probe.context.TryCancel();
    probe.End();
  }
  EXPECT_TRUE(again);

  const auto revoked = std::chrono::steady_clock::now();
  ASSERT_EQ(server.Revoke(invite_id).code, 0);
  for (HealthWatch& watch : watches) {
    const grpc::Status ended = watch.End();
    EXPECT_EQ(ended.error_code(), kUnauthenticated);
    EXPECT_THAT(ended.error_message(), HasSubstr("this invite was revoked"));
  }
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - revoked).count();
  EXPECT_LT(ms, 1000);
  EXPECT_EQ(server.Call("grpc.health.v1.Health/Watch", "", pass).code, kUnauthenticated);
  other.context.TryCancel();
  EXPECT_EQ(other.End().error_code(), grpc::StatusCode::CANCELLED) << "and went on until then";
}

TEST(Health, CheckIsOpenAndWatchAndReflectionAreNot) {
  GuardedServer server;
  const std::string check = "grpc.health.v1.Health/Check", watch = "grpc.health.v1.Health/Watch";
  EXPECT_EQ(server.Call(check, "", "").code, 0);
  const auto web = [&server](const std::string& method, const std::string& token) {
    return CallOverWeb(server.http_port(), server.root_pem(), method, "", token);
  };
  EXPECT_TRUE(web(check, "").message);
  EXPECT_EQ(server.Call(watch, "", "").code, kUnauthenticated);
  EXPECT_EQ(web(watch, "").grpc_status, kUnauthenticated);
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_VIEWER);
  EXPECT_EQ(server.Call(watch, "", pass).code, 0);
  EXPECT_TRUE(web(watch, pass).message);
  for (const char* version : {"v1alpha", "v1"}) {
    const std::string reflection =
        absl::StrCat("grpc.reflection.", version, ".ServerReflection/ServerReflectionInfo");
    EXPECT_EQ(server.Call(reflection, "", pass).code, kUnimplemented);
  }
}

}  // namespace
}  // namespace saccade::testing::limits_test
