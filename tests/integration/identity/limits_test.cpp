// What one caller may ask for, on both ports, before anything of it is parsed.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <thread>

#include "saccade/v1/annotation.grpc.pb.h"
#include "server/identity/role_table.hpp"
#include "tests/integration/attack/socket.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing {
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
    EXPECT_THAT(grpc.message,
                HasSubstr("more than 0.01 calls a second with this invite: try again"));
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
  EXPECT_THAT(refused.body, HasSubstr("0.01 calls a second with this invite: try again in"));
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
  EXPECT_THAT(next.message, HasSubstr("more than 1000 bytes a second with this invite"));
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
}  // namespace saccade::testing
