// What ends while somebody uses it: revoked, expired, used up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <future>
#include <thread>

#include "saccade/v1/session.grpc.pb.h"
#include "server/identity/access_book.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::revocation_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr int kUnauthenticated = 16;

/// Somebody who watches, until the stream ends; `ended` is when and how.
struct Watcher {
  Watcher(GuardedServer& server, std::string pass) : token(std::move(pass)) {
    session = server.Join(token);
    context.AddMetadata("authorization", "Bearer " + token);
    v1::SubscribeRequest request;
    request.set_session_id(session);
    request.set_window(256);
    stub = v1::SessionService::NewStub(server.channel());
    reader = stub->Subscribe(&context, request);
    thread = std::thread([this] {
      v1::Event event;
      while (reader->Read(&event)) ++events;
      status = reader->Finish();
      ended = steady_clock::now();
      done = true;
    });
  }
  ~Watcher() {
    context.TryCancel();
    thread.join();
  }
  bool Sees(int least) const {
    for (int tries = 0; tries < 250 && events < least; ++tries) {
      std::this_thread::sleep_for(milliseconds(20));
    }
    return events >= least;
  }

  const std::string token;
  std::string session;
  grpc::ClientContext context;
  std::unique_ptr<v1::SessionService::Stub> stub;
  std::unique_ptr<grpc::ClientReader<v1::Event>> reader;
  std::thread thread;
  std::atomic<int> events = 0;
  std::atomic<bool> done = false;
  grpc::Status status;
  steady_clock::time_point ended;
};

bool Within(milliseconds limit, const std::function<bool()>& what) {
  const auto end = steady_clock::now() + limit;
  while (!what()) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return true;
}

TEST(Revocation, ThrowsOutRunningStreamsOfBothWaysWithinASecond) {
  GuardedServer server;
  std::string invite_id;
  const std::string invite = server.Invite(v1::ACCESS_ROLE_PILOT, &invite_id, 2);
  std::string first, second;
  ASSERT_EQ(server.Redeem(invite, &first).code, 0);
  ASSERT_EQ(server.Redeem(invite, &second).code, 0);
  Watcher watcher(server, first), other(server, server.PassOf(v1::ACCESS_ROLE_VIEWER));
  // The same by the gateway: read until the stream ends, however much comes.
  v1::SubscribeRequest request;
  request.set_session_id(server.Join(second));
  request.set_window(256);
  const std::string message = request.SerializeAsString();
  HttpsRequest web;
  web.port = server.http_port();
  web.root_pem = server.root_pem();
  web.method = "POST";
  web.target = "/saccade.v1.SessionService/Subscribe";
  web.token = second;
  web.content_type = "application/grpc-web+proto";
  web.body = std::string(4, '\0') + static_cast<char>(message.size()) + message;
  web.first_message_is_enough = false;
  web.patience = milliseconds(20'000);
  std::future<std::pair<HttpsReply, steady_clock::time_point>> page =
      std::async(std::launch::async, [&web] {
        HttpsReply reply = Send(web);
        return std::pair(std::move(reply), steady_clock::now());
      });
  ASSERT_TRUE(watcher.Sees(3));
  ASSERT_TRUE(other.Sees(3));

  const auto revoked = steady_clock::now();
  ASSERT_EQ(server.Revoke(invite_id).code, 0);
  ASSERT_TRUE(Within(milliseconds(3000), [&] { return watcher.done.load(); }));
  const auto [reply, page_ended] = page.get();
  const auto grpc_ms = std::chrono::duration<double, std::milli>(watcher.ended - revoked).count();
  const auto page_ms = std::chrono::duration<double, std::milli>(page_ended - revoked).count();
  std::printf("out after revocation: gRPC %.0f ms, gateway %.0f ms\n", grpc_ms, page_ms);
  EXPECT_LT(grpc_ms, 1000);
  EXPECT_LT(page_ms, 1000);
  EXPECT_EQ(watcher.status.error_code(), kUnauthenticated);
  EXPECT_THAT(watcher.status.error_message(), HasSubstr("this invite was revoked"));
  EXPECT_EQ(reply.grpc_status, kUnauthenticated);
  EXPECT_THAT(reply.grpc_message, HasSubstr("this invite was revoked"));

  // Nor does it come back: not by reconnecting, not by its session, not by the stolen link.
  v1::AcknowledgeRequest acknowledge;
  acknowledge.set_session_id(watcher.session);
  for (const auto& [method, bytes] :
       {std::pair<std::string, std::string>("saccade.v1.SessionService/Join", ""),
        {"saccade.v1.SessionService/Acknowledge", acknowledge.SerializeAsString()},
        {"saccade.v1.SessionService/GetStatus", ""}}) {
    const Outcome outcome = server.Call(method, bytes, watcher.token);
    EXPECT_EQ(outcome.code, kUnauthenticated) << method;
    EXPECT_THAT(outcome.message, HasSubstr("this invite was revoked"));
  }
  EXPECT_THAT(server.Redeem(invite, nullptr).message, HasSubstr("this invite was revoked"));
  // And who came in by another invite has noticed nothing.
  const int before = other.events;
  EXPECT_TRUE(other.Sees(before + 3));
  EXPECT_FALSE(other.done);
}

TEST(Revocation, AReplayedInviteIsUsedUp) {
  GuardedServer server;
  const std::string invite = server.Invite(v1::ACCESS_ROLE_ANNOTATOR);
  EXPECT_EQ(server.Redeem(invite, nullptr).code, 0);
  const Outcome replayed = server.Redeem(invite, nullptr);
  EXPECT_EQ(replayed.code, kUnauthenticated);
  EXPECT_THAT(replayed.message, HasSubstr("used up; ask for a new one"));
}

template <typename Ask>
Issued Wait(Ask ask) {
  std::promise<absl::StatusOr<Issued>> answer;
  ask([&answer](absl::StatusOr<Issued> issued) { answer.set_value(std::move(issued)); });
  return *answer.get_future().get();
}

// An invite of three seconds, made by the book itself beforehand: nobody may ask a server for less
// than a minute.
TEST(Revocation, AStreamEndsWithTheLifeOfItsInvite) {
  std::string pass, open_invite, expired_pass;
  std::int64_t expires_unix_s = 0;
  GuardedServer server([&](const std::string& folder) {
    const auto system = [] {
      return std::chrono::duration_cast<std::chrono::seconds>(
                 std::chrono::system_clock::now().time_since_epoch())
          .count();
    };
    std::atomic<std::int64_t> ago_s = 50;
    AccessBook::Options options;
    options.now_unix_s = [&] { return system() - ago_s; };
    const auto book = *AccessBook::Open(folder, options);
    const auto invite = [&] {
      return Wait([&](auto done) { book->CreateInvite({AccessRole::kViewer, 60, 2, ""}, done); });
    };
    const auto redeem = [&](const std::string& token) {
      return Wait([&](auto done) { book->Redeem(token, done); }).token;
    };
    ago_s = 1000;
    expired_pass = redeem(invite().token);
    ago_s = 46;
    const Issued brief = invite();
    open_invite = brief.token;
    expires_unix_s = brief.invite.expires_unix_s;
    pass = redeem(open_invite);
  });
  EXPECT_THAT(server.Call("saccade.v1.SessionService/Join", "", expired_pass).message,
              HasSubstr("this invite has expired; ask for a new one"));
  Watcher watcher(server, pass);
  ASSERT_TRUE(watcher.Sees(1));
  ASSERT_TRUE(Within(std::chrono::seconds(20), [&] { return watcher.done.load(); }));
  const double late_s =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() -
      static_cast<double>(expires_unix_s);
  std::printf("out %.2f s after it expired\n", late_s);
  EXPECT_GE(late_s, 0);
  EXPECT_LT(late_s, 1.5);
  EXPECT_THAT(watcher.status.error_message(), HasSubstr("this invite has expired"));
  EXPECT_THAT(server.Redeem(open_invite, nullptr).message, HasSubstr("this invite has expired"));
}

}  // namespace
}  // namespace saccade::testing::revocation_test
