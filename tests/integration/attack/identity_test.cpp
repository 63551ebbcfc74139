// Nobody is told anybody else's credential, and no name writes a line of its own.
#include <absl/strings/str_split.h>

#include <thread>

#include "saccade/v1/gaze.pb.h"
#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attack_test.hpp"

namespace saccade::testing::identity_test {
namespace {

class Identity : public AttackTest {
 protected:
  void SetUp() override {
    TargetOptions options;
    options.mount = "crop:";
    Begin(options);
  }

  /// Everything that a stranger's stream brings within `span`, as bytes.
  std::string Overhear(const std::string& session_id, milliseconds span) {
    v1::SubscribeRequest request;
    request.set_session_id(session_id);
    const int port = target_->http_port();
    Socket socket(port);
    socket.Send(
        GrpcWebCall(port, "/saccade.v1.SessionService/Subscribe", request.SerializeAsString()));
    std::string heard;
    for (const auto end = Clock::now() + span; Clock::now() < end;) {
      heard += socket.Receive(milliseconds(100), {}, 1 << 16);
    }
    return heard;
  }
};

TEST_F(Identity, NoAnswerHoldsAnothersSession) {
  const auto channel = target_->NewChannel();
  const std::string secret = expert_->session_id();
  v1::AcquireLeaseRequest lease;
  lease.set_session_id(secret);
  v1::AcquireLeaseResponse leased;
  ASSERT_TRUE(Ask(channel, "GazeService/AcquireLease", lease, leased).status.ok());
  ASSERT_TRUE(leased.granted());

  const std::string stranger = JoinSession(channel, v1::ROLE_EXPERT);
  int answers = 0;
  for (const std::string& method : MethodNames()) {
    if (method.find("Subscribe") != std::string::npos) continue;
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const std::string request =
          seed == 1 ? std::string() : FuzzedRequest(method, stranger, kSeed + seed);
      const RawReply reply = Call(channel, method, request, milliseconds(500));
      ++answers;
      const std::string all = reply.bytes + reply.status.error_details();
      EXPECT_EQ(all.find(secret), std::string::npos) << method;
      EXPECT_EQ(reply.status.error_message().find(secret), std::string::npos) << method;
    }
  }
  tally_.Add("answers read", answers);
  std::string heard;
  std::jthread renew([&](const std::stop_token& stop) {
    lease.set_lease_id(leased.lease_id());
    while (!stop.stop_requested()) {
      Ask(channel, "GazeService/AcquireLease", lease, leased);
      std::this_thread::sleep_for(milliseconds(150));
    }
  });
  heard = Overhear(stranger, seconds(2));
  renew.request_stop();
  renew.join();
  tally_.Add("bytes overheard", static_cast<long>(heard.size()));
  EXPECT_GT(heard.size(), 10'000u);
  EXPECT_NE(heard.find("Good Expert"), std::string::npos) << "presence was not overheard";
  EXPECT_EQ(heard.find(secret), std::string::npos) << "a stream tells the expert's session";
  EXPECT_EQ(target_->process().err().find(secret), std::string::npos) << "the log tells it";
  DeleteStrangersAnnotations(*target_);
}

// U+0000 to U+001F, U+007F to U+009F, line and paragraph separators, direction marks.
bool Harmless(const std::string& text) {
  for (const unsigned char byte : text) {
    if (byte < 0x20 || byte == 0x7f) return false;
  }
  for (const char* bad : {"\xc2\x80", "\xc2\x85", "\xc2\x9b", "\xe2\x80\xa8", "\xe2\x80\xa9",
                          "\xe2\x80\xae", "\xe2\x80\xaa", "\xe2\x81\xa6", "\xe2\x80\x8f"}) {
    if (text.find(bad) != std::string::npos) return false;
  }
  return true;
}

TEST_F(Identity, NamesAreRefusedOrHarmless) {
  const auto channel = target_->NewChannel();
  const std::string forged = "2026-11-28T00:00:00.000Z rpc Join session=forged ok";
  for (const std::string& name : std::initializer_list<std::string>{
           "a\n" + forged, "a\r" + forged, "a\r\n" + forged, std::string("\x1b[2J\x1b[31mred"),
           std::string("a\x7f"), std::string("a\xc2\x85") + forged,
           std::string("a\xe2\x80\xa8") + forged, std::string("\xe2\x80\xae") + "drawer",
           std::string("\xe2\x81\xa6isolated"), std::string("a\xc2\x9b") + "31m",
           std::string("a\0b", 3), std::string("a\tb")}) {
    v1::JoinRequest request;
    request.set_display_name(name);
    v1::JoinResponse response;
    const RawReply reply = Ask(channel, "SessionService/Join", request, response);
    tally_.Add(reply.status);
    if (!reply.status.ok()) continue;
    v1::SubscribeRequest subscribe;
    subscribe.set_session_id(response.session_id());
    const int port = target_->http_port();
    Socket stream(port);
    stream.Send(
        GrpcWebCall(port, "/saccade.v1.SessionService/Subscribe", subscribe.SerializeAsString()));
    WaitForParticipants(2, seconds(3));
    v1::GetStatusResponse status;
    Ask(channel, "SessionService/GetStatus", v1::GetStatusRequest(), status);
    for (const v1::Participant& one : status.presence().participants()) {
      EXPECT_TRUE(Harmless(one.display_name())) << ::testing::PrintToString(one.display_name());
    }
    stream.Close();
    WaitForParticipants(1, seconds(3));
  }
}

// The head changes hands, and the log says whose they are.
void PilotAs(const std::shared_ptr<grpc::Channel>& channel, const std::string& name) {
  for (const v1::Role role : {v1::ROLE_EXPERT, v1::ROLE_WEARER}) {
    const std::string session_id = JoinSession(channel, role, seconds(2), name);
    if (session_id.empty()) continue;  // refused
    v1::AcquireLeaseRequest acquire;
    acquire.set_session_id(session_id);
    v1::AcquireLeaseResponse acquired;
    Ask(channel, "GazeService/AcquireLease", acquire, acquired);
    v1::OverrideRequest take;
    take.set_session_id(session_id);
    take.set_enabled(role == v1::ROLE_WEARER);
    v1::OverrideResponse taken;
    Ask(channel, "GazeService/Override", take, taken);
    take.set_enabled(false);
    Ask(channel, "GazeService/Override", take, taken);
    v1::ReleaseLeaseRequest release;
    release.set_session_id(session_id);
    v1::ReleaseLeaseResponse released;
    Ask(channel, "GazeService/ReleaseLease", release, released);
  }
}

TEST_F(Identity, NoTextWritesALineIntoTheLog) {
  const auto channel = target_->NewChannel();
  const int port = target_->http_port();
  for (const std::string end : {"\n", "\r", "\r\n", "\x0b", "\x1b[1G"}) {
    PilotAs(channel, "x" + end + "FORGED line");
    for (const std::string& method : MethodNames()) {
      Call(channel, method, RequestWithText(method, "x" + end + "FORGED line"), milliseconds(200));
    }
    AnswerTo(port, HttpHead(port, "GET", "/x" + end + "FORGED"), milliseconds(100));
    AnswerTo(port, "GET / HTTP/1.1\r\nHost: x" + end + "FORGED\r\n\r\n", milliseconds(100));
  }
  std::this_thread::sleep_for(milliseconds(200));
  const std::string log = target_->process().err();
  for (const absl::string_view line : absl::StrSplit(log, absl::ByAnyChar("\n\r\x0b"))) {
    EXPECT_NE(line.substr(0, 6), "FORGED") << line;
  }
  EXPECT_EQ(log.find('\x1b'), std::string::npos) << "an escape sequence stands in the log";
}

}  // namespace
}  // namespace saccade::testing::identity_test
