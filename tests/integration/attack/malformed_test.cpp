// What is no HTTP, no gRPC-Web, no HTTP/2 and no message; and what never ends.
#include "saccade/v1/annotation.pb.h"
#include "tests/integration/attack/attack_test.hpp"

namespace saccade::testing::malformed_test {
namespace {

using Malformed = AttackTest;

TEST_F(Malformed, ForwardedHeadersThatMetadataMayNotHoldAreRefused) {
  SendAll(ForwardedHeaderCases(target_->http_port()));
}

TEST_F(Malformed, GrpcWebIsRefused) { SendAll(GrpcWebCases(target_->http_port())); }

TEST_F(Malformed, HttpIsRefused) { SendAll(HttpCases(target_->http_port())); }

// The allocator keeps what the worst moment needed; a second time nothing more is needed.
TEST_F(Malformed, Http2IsRefusedAndNotKept) {
  std::vector<long> held_kib = {SteadyMemory()};
  for (int pass = 0; pass < 2; ++pass) {
    for (const Http2Case& one : Http2Cases()) {
      Socket socket(target_->grpc_port());
      ASSERT_TRUE(socket.ok()) << one.name;
      socket.Send(one.bytes, seconds(2));
      tally_.Add(socket.ClosedByPeer(milliseconds(60)) ? "closed" : "held");
      ASSERT_TRUE(target_->Alive()) << one.name << ": " << target_->Obituary();
    }
    held_kib.push_back(SteadyMemory());
  }
  tally_.Add("KiB more after the first", held_kib[1] - held_kib[0]);
  tally_.Add("KiB more after the second", held_kib[2] - held_kib[1]);
  EXPECT_LT(held_kib[1] - held_kib[0], 160 * 1024);
  // As much as the server lets the allocator keep unused (Engine: what it gives back).
  EXPECT_LT(held_kib[2] - held_kib[1], 64 * 1024);
}

TEST_F(Malformed, MessagesFromDescriptorsEndNothing) {
  ASSERT_GE(MethodNames().size(), 30u);
  v1::CreateAnnotationRequest request;
  int sound = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    sound += request.ParseFromString(
        FuzzedRequest("/saccade.v1.AnnotationService/Create", expert_->session_id(), seed));
  }
  ASSERT_EQ(sound, 100) << "requests that are messages";
  Run(seconds(6), FuzzMethods);
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  DeleteStrangersAnnotations(*target_);
}

TEST_F(Malformed, WhatNeverEndsIsNotKept) {
  const long before_kib = SteadyMemory();
  PeakMemory peak(target_->pid());
  Run(seconds(30), [](const Battle& battle) { SendEndlessHttp(battle, 200); });
  const long grown_kib = peak.kib() - before_kib;
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  tally_.Add("KiB more at the peak", grown_kib);
  EXPECT_LT(grown_kib, 30 * 1024);
}

// Half of them Pings, half pages that are not there; how many of each were answered.
std::pair<int, int> SendAtOnce(int port, int requests) {
  std::string many;
  for (int i = 0; i < requests; ++i) {
    many += i % 2 == 0 ? GrpcWebCall(port, "/saccade.v1.SessionService/Ping", "")
                       : HttpHead(port, "GET", "/none" + std::to_string(i));
  }
  Socket socket(port);
  socket.Send(many);
  std::string answers;
  const auto count = [&](const std::string& what) {
    int found = 0;
    for (auto at = answers.find(what); at != std::string::npos; at = answers.find(what, at + 1)) {
      ++found;
    }
    return found;
  };
  for (const auto end = Clock::now() + seconds(10); Clock::now() < end;) {
    answers += socket.Receive(milliseconds(300), {}, 65'536);
    if (count("HTTP/1.1 ") == requests || socket.ClosedByPeer(milliseconds(0))) break;
  }
  return {count("HTTP/1.1 200"), count("HTTP/1.1 404")};
}

TEST_F(Malformed, PipelinedRequestsAreAnsweredInTurn) {
  const auto [pings, pages] = SendAtOnce(target_->http_port(), 100);
  EXPECT_EQ(pings, 50);
  EXPECT_EQ(pages, 50);
  // More at once may be refused.
  const auto [of_1000, pages_of_1000] = SendAtOnce(target_->http_port(), 1000);
  tally_.Add("of 1000 answered", of_1000 + pages_of_1000);
}

TEST_F(Malformed, ByteByByteHoldsNobodyUp) {
  Run(seconds(3), [](const Battle& battle) { DripBytes(battle, 100, milliseconds(50)); });
}

}  // namespace
}  // namespace saccade::testing::malformed_test
