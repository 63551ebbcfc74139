// Who reads or writes slowly costs nobody else: the good expert's poses come as often as before.
#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include <atomic>
#include <cstdio>
#include <deque>
#include <memory>
#include <thread>
#include <vector>

#include "saccade/v1/session.grpc.pb.h"
#include "tests/integration/attack/socket.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/tls_socket.hpp"

namespace saccade::testing::slow_peers_test {
namespace {

constexpr int kSlow = 25;  // of each kind: 50 readers, 75 writers
constexpr double kLeastShare = 0.8;

void Authorise(grpc::ClientContext& context, const std::string& token) {
  context.AddMetadata("authorization", "Bearer " + token);
}

/// Reads everything and acknowledges it.
class Expert {
 public:
  Expert(GuardedServer& server, const std::string& token) : token_(token) {
    stub_ = v1::SessionService::NewStub(server.NewChannel());
    session_ = server.Join(token);
    Authorise(context_, token);
    v1::SubscribeRequest request;
    request.set_session_id(session_);
    reader_ = stub_->Subscribe(&context_, request);
    thread_ = std::thread([this] { Read(); });
  }
  ~Expert() {
    context_.TryCancel();
    thread_.join();
  }
  double PoseRate(milliseconds span) const {
    const auto from = Clock::now();
    const int before = poses_;
    std::this_thread::sleep_for(span);
    return (poses_ - before) / std::chrono::duration<double>(Clock::now() - from).count();
  }
  bool ended() const { return ended_; }

 private:
  void Read() {
    v1::Event event;
    while (reader_->Read(&event)) {
      if (event.has_pose()) ++poses_;
      if (event.sequence() % 8 == 0) Acknowledge(event.sequence());
    }
    reader_->Finish();
    ended_ = true;
  }
  void Acknowledge(std::uint64_t sequence) {
    grpc::ClientContext context;
    Authorise(context, token_);
    v1::AcknowledgeRequest request;
    request.set_session_id(session_);
    request.set_sequence(sequence);
    v1::AcknowledgeResponse response;
    stub_->Acknowledge(&context, request, &response);
  }

  const std::string token_;
  std::string session_;
  std::unique_ptr<v1::SessionService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::Event>> reader_;
  std::atomic<int> poses_ = 0;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

/// A stream of gRPC that nobody reads.
struct UnreadStream {
  UnreadStream(GuardedServer& server, const std::string& token)
      : stub(v1::SessionService::NewStub(server.NewChannel())) {
    Authorise(context, token);
    v1::SubscribeRequest request;
    request.set_session_id(server.Join(token));
    reader = stub->Subscribe(&context, request);
  }
  ~UnreadStream() {
    context.TryCancel();
    reader->Finish();
  }
  std::unique_ptr<v1::SessionService::Stub> stub;
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<v1::Event>> reader;
};

std::string SubscribeOverWeb(GuardedServer& server, const std::string& token) {
  v1::SubscribeRequest request;
  request.set_session_id(server.Join(token));
  return GrpcWebCall(server.http_port(), "/saccade.v1.SessionService/Subscribe",
                     request.SerializeAsString(), "Authorization: Bearer " + token + "\r\n");
}

/// Everybody slow, at once, until it goes.
class SlowPeers {
 public:
  SlowPeers(GuardedServer& server, const std::string& token, bool tls) {
    for (int i = 0; i < kSlow; ++i) {
      unread_.push_back(std::make_unique<UnreadStream>(server, token));
      const std::string subscribe = SubscribeOverWeb(server, token);
      if (tls) {
        for (auto* kind : {&readers_, &writers_}) {
          kind->push_back(std::make_unique<TlsSocket>(server.http_port(), server.root_pem(),
                                                      TLS1_3_VERSION, TLS1_3_VERSION, 4096));
        }
        readers_.back()->Write(subscribe);
      } else {
        plain_.emplace_back(server.http_port(), 4096);
        plain_.back().Send(subscribe);
        drips_.emplace_back(server.http_port());
      }
      drips_.emplace_back(server.http_port());
      drips_.emplace_back(server.grpc_port());
    }
    thread_ = std::jthread([this, tls](const std::stop_token& stop) {
      const std::string head =
          tls ? std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11)
              : "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: aaaaaaaaaaaaaaaaaa";
      for (std::size_t at = 0; !stop.stop_requested(); ++at) {
        for (Socket& one : drips_) one.Send(head.substr(at % head.size(), 1), milliseconds(1));
        for (auto& one : writers_) one->Write("G");
        std::this_thread::sleep_for(milliseconds(200));
      }
    });
  }
  std::size_t readers() const { return unread_.size() + readers_.size() + plain_.size(); }
  std::size_t writers() const { return drips_.size() + writers_.size(); }

 private:
  std::vector<std::unique_ptr<UnreadStream>> unread_;
  std::vector<std::unique_ptr<TlsSocket>> readers_, writers_;
  std::deque<Socket> plain_, drips_;
  std::jthread thread_;
};

void SlowPeersCostNobodyElse(bool tls) {
  // Otherwise as it is shipped.
  GuardedServer server({.limits = "sessions = 200\nthis_machine = true\n", .tls = tls});
  Expert expert(server, server.PassOf(v1::ACCESS_ROLE_PILOT));
  const std::string slow_pass = server.PassOf(v1::ACCESS_ROLE_PILOT);
  expert.PoseRate(milliseconds(2000));  // until the map has begun
  const double quiet_hz = expert.PoseRate(milliseconds(4000));
  double hz = 0;
  {
    const SlowPeers slow(server, slow_pass, tls);
    EXPECT_GE(slow.readers(), 50u);
    EXPECT_GE(slow.writers(), 75u);
    expert.PoseRate(milliseconds(1500));  // until their sockets are full
    hz = expert.PoseRate(milliseconds(4000));
  }
  std::printf("poses a second: %.1f alone, %.1f beside the slow (%.2f)\n", quiet_hz, hz,
              hz / quiet_hz);
  EXPECT_FALSE(expert.ended());
  ASSERT_GT(quiet_hz, 1);
  EXPECT_GE(hz, kLeastShare * quiet_hz);
}

TEST(SlowPeers, CostNobodyElseOverTls) { SlowPeersCostNobodyElse(true); }
TEST(SlowPeers, CostNobodyElseInPlain) { SlowPeersCostNobodyElse(false); }

}  // namespace
}  // namespace saccade::testing::slow_peers_test
