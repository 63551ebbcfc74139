// Peers that go or stay without a word; descriptors used up.
#include <deque>
#include <thread>

#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attack_test.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::vanishing_test {
namespace {

using Vanishing = AttackTest;

constexpr char kSubscribe[] = "/saccade.v1.SessionService/Subscribe";

std::string SubscribeAs(const std::string& session_id) {
  v1::SubscribeRequest request;
  request.set_session_id(session_id);
  request.set_window(1);  // then the stream holds, and no write fails
  return request.SerializeAsString();
}

TEST_F(Vanishing, OneByteThenTheEndIsNoticed) {
  constexpr int kGhosts = 10;
  const auto channel = target_->NewChannel();
  std::deque<Socket> sockets;
  for (int i = 0; i < kGhosts; ++i) {
    const std::string session_id = JoinSession(channel, v1::ROLE_VIEWER);
    sockets.emplace_back(target_->http_port());
    sockets.back().Send(GrpcWebCall(target_->http_port(), kSubscribe, SubscribeAs(session_id)));
  }
  ASSERT_TRUE(WaitForParticipants(1 + kGhosts, seconds(5))) << Participants();
  const int descriptors = target_->vitals().descriptors;
  for (Socket& socket : sockets) {
    // Nothing may be left unread, or the system says more than a mere end.
    while (!socket.Receive(milliseconds(100)).empty()) {
    }
    socket.Send("x");
    socket.Close();
  }
  EXPECT_TRUE(WaitForParticipants(1, seconds(5))) << Participants() << " participants";
  EXPECT_LE(target_->vitals().descriptors, descriptors - kGhosts + 2);
}

TEST_F(Vanishing, AfterAThousandGhostsAPageIsServed) {
  const Vitals before = target_->vitals();
  Run(seconds(25), [](const Battle& battle) {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 6; ++i) threads.emplace_back([&] { LeaveGhosts(battle, 1004); });
  });
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  EXPECT_GE(tally_.of("ghosts"), 1004);
  EXPECT_EQ(target_->Unwell(), "");
  EXPECT_TRUE(WaitForParticipants(1, seconds(5))) << Participants() << " participants";
  EXPECT_LE(target_->vitals().descriptors, before.descriptors + 10);
}

// Sockets that stay open and say nothing: no FIN, nothing read, nothing acknowledged.
TEST_F(Vanishing, WhoIsSilentFor40SecondsIsGone) {
  const auto channel = target_->NewChannel();
  std::deque<Socket> sockets;
  for (int i = 0; i < 4; ++i) {
    const std::string session_id = JoinSession(channel, v1::ROLE_WEARER);
    const bool web = i % 2 == 0;
    sockets.emplace_back(web ? target_->http_port() : target_->grpc_port(), 4096);
    sockets.back().Send(web ? GrpcWebCall(target_->http_port(), kSubscribe, SubscribeAs(session_id))
                            : Http2Call(kSubscribe, SubscribeAs(session_id)));
  }
  ASSERT_TRUE(WaitForParticipants(5, seconds(5))) << Participants();
  const auto from = Clock::now();
  EXPECT_TRUE(WaitForParticipants(1, seconds(40))) << Participants() << " participants";
  tally_.Add("s until they were gone",
             std::chrono::duration_cast<seconds>(Clock::now() - from).count());
}

TEST_F(Vanishing, ReadersOfAByteASecondHoldNobodyUp) {
  const long before_kib = SteadyMemory();
  const double quiet_hz = expert_->PoseRate(seconds(2));
  double hz = 0;
  long grown_kib = 0;
  Run(seconds(10), [&](const Battle& battle) {
    std::jthread readers([&] {
      GiveWay();
      ReadSlowly(battle, 50);
    });
    while (!battle.over() && tally_.of("slow readers") == 0) battle.Rest(milliseconds(50));
    hz = expert_->PoseRate(seconds(3));
    grown_kib = target_->vitals().rss_kib - before_kib;
  });
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  tally_.Add("KiB more", grown_kib);
  EXPECT_GE(tally_.of("slow readers"), 20);
  EXPECT_LT(grown_kib, 64 * 1024);  // about 1 MB each, most of it gRPC's; none that grows with time
  if (quiet_hz < 15) {
    tally_.Add("not judged: machine too slow");
  } else {
    EXPECT_GE(hz, 0.8 * quiet_hz);
  }
  EXPECT_TRUE(WaitForParticipants(1, seconds(5))) << Participants() << " participants";
}

class Descriptors : public AttackTest {
 protected:
  void SetUp() override {}
  void UseUp(int limit, const std::string& source) {
    TargetOptions options;
    options.descriptors = limit;
    if (!source.empty()) options.source = source;
    Begin(options);
    if (HasFatalFailure()) return;
    Run(seconds(4),
        [&](const Battle& battle) { UseUpDescriptors(battle, limit + 150, milliseconds(3500)); });
    ASSERT_TRUE(target_->Alive()) << target_->Obituary();
    std::string unwell = "not asked";
    for (const auto end = Clock::now() + seconds(5); !unwell.empty() && Clock::now() < end;) {
      unwell = target_->Unwell();
    }
    EXPECT_EQ(unwell, "") << "5 s after the connections are gone";
  }
};

TEST_F(Descriptors, BothPortsHealAfter1024) { UseUp(1024, ""); }

TEST_F(Descriptors, BothPortsHealAfter256AndTheDataSetWaits) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = 900});  // 30 s
  UseUp(256, "dataset:" + (folder / "set"));
  v1::GetStatusResponse status;
  ASSERT_TRUE(Ask(target_->NewChannel(), "SessionService/GetStatus", v1::GetStatusRequest(), status)
                  .status.ok());
  EXPECT_EQ(status.statistics().bad_frames(), 0u);
  EXPECT_FALSE(status.source_ended());
}

}  // namespace
}  // namespace saccade::testing::vanishing_test
