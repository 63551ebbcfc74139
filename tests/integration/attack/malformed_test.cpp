// What is no HTTP, no gRPC-Web, no HTTP/2 and no message; and what never ends.
#include "saccade/v1/annotation.pb.h"
#include "tests/integration/attack/attack_test.hpp"

namespace saccade::testing {
namespace {

using Malformed = AttackTest;

TEST_F(Malformed, ForwardedHeadersThatMetadataMayNotHoldAreRefused) {
  SendAll(ForwardedHeaderCases(target_->http_port()));
}

TEST_F(Malformed, GrpcWebIsRefused) { SendAll(GrpcWebCases(target_->http_port())); }

TEST_F(Malformed, HttpIsRefused) { SendAll(HttpCases(target_->http_port())); }

TEST_F(Malformed, Http2IsRefusedAndNotKept) {
  const long before_kib = SteadyMemory();
  for (const Http2Case& one : Http2Cases()) {
    Socket socket(target_->grpc_port());
    ASSERT_TRUE(socket.ok()) << one.name;
    socket.Send(one.bytes, seconds(2));
    tally_.Add(socket.ClosedByPeer(milliseconds(60)) ? "closed" : "held");
    ASSERT_TRUE(target_->Alive()) << one.name << ": " << target_->Obituary();
  }
  const long grown_kib = target_->vitals().rss_kib - before_kib;
  tally_.Add("KiB more in the end", grown_kib);
  EXPECT_LT(grown_kib, 60 * 1024);
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

TEST_F(Malformed, AThousandRequestsAtOnceAreAnsweredInTurn) {
  const int port = target_->http_port();
  std::string many;
  for (int i = 0; i < 1000; ++i) {
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
    answers += socket.Receive(milliseconds(500), {}, 65'536);
    if (count("HTTP/1.1 ") == 1000) break;
  }
  tally_.Add("Pings answered", count("HTTP/1.1 200"));
  tally_.Add("pages not found", count("HTTP/1.1 404"));
  EXPECT_EQ(count("HTTP/1.1 200"), 500);
  EXPECT_EQ(count("HTTP/1.1 404"), 500);
}

TEST_F(Malformed, ByteByByteHoldsNobodyUp) {
  Run(seconds(3), [](const Battle& battle) { DripBytes(battle, 100, milliseconds(50)); });
}

}  // namespace
}  // namespace saccade::testing
