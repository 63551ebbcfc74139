// A phone's WebSocket, through the real gateway, the real book of invites and the real source.
#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <future>
#include <thread>

#include "http_client.hpp"
#include "server/gateway/gateway.hpp"
#include "server/identity/certificate_files.hpp"
#include "server/wear/wearer_entrance.hpp"
#include "tests/unit/server/capture/phone_fixture.hpp"
#include "wearer_client.hpp"

namespace saccade::wearer_socket_test {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using Down = v1::WearerDownstream;

class WearerSocketTest : public ::testing::Test {
 protected:
  void SetUp() override { Open(true); }
  void TearDown() override {
    if (gateway_) gateway_->Stop();
    if (source_) source_->Stop();
  }

  void Open(bool tokens, GatewayOptions options = {}, bool with_phone = true) {
    TearDown();
    gateway_.reset();
    access_ = AccessBook::InMemory({.token_required = tokens, .now_unix_s = {}});
    SourceOptions live;
    live.realtime = true;
    auto source = PhoneSource::Open("?size=320x240", live);
    ASSERT_TRUE(source.ok()) << source.status();
    source_ = *std::move(source);
    entrance_ = std::make_unique<WearerEntrance>(*access_, with_phone ? source_.get() : nullptr,
                                                 "sim:desk");
    options.port = 0;
    options.wearer = entrance_.get();
    auto gateway = Gateway::Start(options, nullptr);
    ASSERT_TRUE(gateway.ok()) << gateway.status();
    gateway_ = *std::move(gateway);
  }

  std::string PassOf(AccessRole role) {
    const Issued invite = Answer([&](AccessBook::Done<Issued> done) {
      access_->CreateInvite({role, 3600, 1, "test"}, std::move(done));
    });
    invite_id_ = invite.invite.id;
    return Answer([&](AccessBook::Done<Issued> done) {
             access_->Redeem(invite.token, std::move(done));
           })
        .token;
  }
  /// Answers come from the book's thread.
  template <class Ask>
  static Issued Answer(Ask ask) {
    const auto promise = std::make_shared<std::promise<absl::StatusOr<Issued>>>();
    ask([promise](absl::StatusOr<Issued> issued) { promise->set_value(std::move(issued)); });
    const absl::StatusOr<Issued> issued = promise->get_future().get();
    EXPECT_TRUE(issued.ok()) << issued.status();
    return issued.ok() ? *issued : Issued{};
  }

  /// What it is refused with; and it is out.
  template <class Client>
  std::string RefusedWith(Client& client) {
    const auto message = client.Await(Down::kRefused);
    EXPECT_TRUE(client.Ended());
    return message ? message->refused().reason() : "not refused";
  }

  template <class Client>
  void SendPicture(Client& client, FakePhone& phone, int number, bool key) {
    const CodedPicture coded = phone.Code(number, key);
    v1::WearerUpstream message;
    v1::WearerPicture& picture = *message.mutable_picture();
    picture.set_picture_id(coded.picture_id);
    picture.set_codec(v1::WEARER_CODEC_H264);
    picture.set_key_frame(coded.key_frame);
    picture.set_capture_ns(coded.capture_ns);
    picture.set_data(coded.data);
    client.Send(message);
  }
  int NextNumber() {
    const auto frame = source_->Next();
    return frame.ok() && frame->has_value() ? NumberIn((*frame)->grey) : -1;
  }

  /// The status of an answer to a request for a WebSocket.
  int AnswerTo(const std::string& path, const std::string& origin,
               const std::string& host = "localhost") {
    HttpClient client(port());
    client.Send("GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\n" + origin +
                "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    return client.ReadReply(/*head_only=*/true).status;
  }

  int port() const { return gateway_->port(); }
  std::string origin() const { return "http://127.0.0.1:" + std::to_string(port()); }

  std::unique_ptr<AccessBook> access_;
  std::unique_ptr<PhoneSource> source_;
  std::unique_ptr<WearerEntrance> entrance_;
  std::unique_ptr<Gateway> gateway_;
  std::string invite_id_;
};

TEST_F(WearerSocketTest, AWearersPicturesBecomeFrames) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  const auto welcome = client.Await(Down::kWelcome);
  ASSERT_TRUE(welcome.has_value());
  EXPECT_EQ(welcome->welcome().width(), 320u);
  EXPECT_EQ(welcome->welcome().height(), 240u);
  EXPECT_EQ(welcome->welcome().fps_hz(), 30u);
  FakePhone phone;
  for (int i = 1; i <= 10; ++i) {
    SendPicture(client, phone, i, i == 1);
    ASSERT_EQ(NextNumber(), i);
  }
}

TEST_F(WearerSocketTest, TheSameOverTls) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("wearer-" + std::to_string(getpid()));
  ServerNames names;
  names.Add("127.0.0.1");
  const auto identity = EnsureServerIdentity(folder, names, std::time(nullptr));
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(identity.ok()) << identity.status();
  GatewayOptions options;
  options.tls_chain_pem = identity->chain_pem;
  options.tls_key_pem = identity->key_pem;
  Open(true, options);
  WearerClient<EncryptedStream> client(port());
  ASSERT_TRUE(client.Upgrade("https://127.0.0.1:" + std::to_string(port())));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  FakePhone phone;
  for (int i = 1; i <= 10; ++i) {
    SendPicture(client, phone, i, i == 1);
    ASSERT_EQ(NextNumber(), i);
  }
  // A page that came without TLS may not.
  WearerClient<EncryptedStream> downgraded(port());
  EXPECT_FALSE(downgraded.Upgrade(origin()));
}

TEST_F(WearerSocketTest, ForeignPagesAndNamesDoNotGetTheSocket) {
  for (const std::string foreign : {"http://evil.example", "null", "http://127.0.0.1:1"}) {
    EXPECT_EQ(AnswerTo("/wear/upstream", "Origin: " + foreign), 403) << foreign;
  }
  EXPECT_EQ(AnswerTo("/wear/upstream", "Origin: http://evil.example", "evil.example"), 421);
  EXPECT_EQ(AnswerTo("/wear/other", "Origin: http://localhost"), 404);
  EXPECT_EQ(AnswerTo("/wear/upstream", "Origin: http://localhost"), 101);
}

TEST_F(WearerSocketTest, TokensAndRolesAreAskedFor) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "invite"},
      {"p000000000000.AAAA", "access"},
      {std::string(4000, 'x'), "access"},
      {PassOf(AccessRole::kViewer), "takes the role wearer, and yours is viewer"},
      {PassOf(AccessRole::kAnnotator), "takes the role wearer, and yours is annotator"},
      {PassOf(AccessRole::kPilot), "takes the role wearer, and yours is pilot"}};
  for (const auto& [token, words] : cases) {
    WearerClient<> client(port());
    ASSERT_TRUE(client.Upgrade(origin()));
    ASSERT_TRUE(client.Hello(token));
    const std::string reason = RefusedWith(client);
    EXPECT_THAT(reason, HasSubstr(words)) << token;
  }
  WearerClient<> owner(port());
  ASSERT_TRUE(owner.Upgrade(origin()));
  ASSERT_TRUE(owner.Hello(access_->owner_token()));
  EXPECT_TRUE(owner.Await(Down::kWelcome).has_value());
}

TEST_F(WearerSocketTest, NothingIsTakenBeforeTheHello) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  FakePhone phone;
  SendPicture(client, phone, 1, true);
  EXPECT_TRUE(client.Ended());
  EXPECT_EQ(source_->dropped_frames() + source_->bad_frames(), 0u);
}

TEST_F(WearerSocketTest, AMessageIsMeasuredBeforeItIsRead) {
  // A hello has 4 KiB, whatever its head says of what follows.
  WearerClient<> stranger(port());
  ASSERT_TRUE(stranger.Upgrade(origin()));
  stranger.SendBytes(std::string(5000, 'x'));
  EXPECT_TRUE(stranger.Ended());
  EXPECT_EQ(stranger.close_code(), 1009);
  WearerClient<> wearer(port());
  ASSERT_TRUE(wearer.Upgrade(origin()));
  ASSERT_TRUE(wearer.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(wearer.Await(Down::kWelcome).has_value());
  wearer.SendBytes(std::string((1 << 20) + 1000, 'x'));
  EXPECT_TRUE(wearer.Ended());
}

TEST_F(WearerSocketTest, GarbageEndsTheLinkInWordsAndNothingElse) {
  const std::string token = PassOf(AccessRole::kWearer);
  v1::WearerUpstream turned, unknown;
  turned.mutable_picture()->set_codec(v1::WEARER_CODEC_H264);
  turned.mutable_picture()->set_clockwise_deg(45);
  unknown.mutable_picture()->set_codec(static_cast<v1::WearerCodec>(77));
  for (const std::string& bytes : {std::string("\xff\xff\xff\xff\xff\xff"), std::string(900, '\0'),
                                   turned.SerializeAsString(), unknown.SerializeAsString()}) {
    WearerClient<> client(port());
    ASSERT_TRUE(client.Upgrade(origin()));
    ASSERT_TRUE(client.Hello(token));
    ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
    client.SendBytes(bytes);
    EXPECT_NE(RefusedWith(client), "not refused");
  }
  WearerClient<> after(port());
  ASSERT_TRUE(after.Upgrade(origin()));
  ASSERT_TRUE(after.Hello(token));
  EXPECT_TRUE(after.Await(Down::kWelcome).has_value());
}

TEST_F(WearerSocketTest, AFloodOfMessagesEndsTheLink) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  v1::WearerUpstream motion;
  motion.mutable_motion()->set_time_ns(1);
  for (int i = 0; i < 1000; ++i) {
    if (!client.Send(motion)) break;
  }
  EXPECT_THAT(RefusedWith(client), HasSubstr("too many messages"));
}

TEST_F(WearerSocketTest, MoreBytesThanAnyPhoneSendsEndTheLink) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  v1::WearerUpstream message;
  message.mutable_picture()->set_codec(v1::WEARER_CODEC_H264);
  message.mutable_picture()->set_data(std::string(1 << 20, 'x'));
  for (int i = 0; i < 20 && client.Send(message); ++i) {
  }
  EXPECT_THAT(RefusedWith(client), HasSubstr("6 MB a second"));
}

TEST_F(WearerSocketTest, LinksWithoutAHelloAreFewAndShort) {
  const std::string token = PassOf(AccessRole::kWearer);
  std::vector<std::unique_ptr<WearerClient<>>> silent;
  for (int i = 0; i < 128; ++i) {
    silent.push_back(std::make_unique<WearerClient<>>(port()));
    ASSERT_TRUE(silent.back()->Upgrade(origin())) << i;
  }
  WearerClient<> one_more(port());
  ASSERT_TRUE(one_more.Upgrade(origin()));
  one_more.Hello(token);
  EXPECT_THAT(RefusedWith(one_more), HasSubstr("too many links"));
  EXPECT_THAT(RefusedWith(*silent.front()), HasSubstr("no hello came"));
  silent.clear();
  std::this_thread::sleep_for(milliseconds(300));
  WearerClient<> after(port());
  ASSERT_TRUE(after.Upgrade(origin()));
  ASSERT_TRUE(after.Hello(token));
  EXPECT_TRUE(after.Await(Down::kWelcome).has_value());
}

TEST_F(WearerSocketTest, OnePhoneAtATimeAndTheSameOneTakesOver) {
  const std::string token = PassOf(AccessRole::kWearer), other = PassOf(AccessRole::kWearer);
  WearerClient<> first(port());
  ASSERT_TRUE(first.Upgrade(origin()));
  ASSERT_TRUE(first.Hello(token, "phone-1"));
  ASSERT_TRUE(first.Await(Down::kWelcome).has_value());
  for (const auto& [pass, phone] : {std::pair(other, "phone-2"), std::pair(token, "phone-2"),
                                    std::pair(other, "phone-1"), std::pair(token, "")}) {
    WearerClient<> second(port());
    ASSERT_TRUE(second.Upgrade(origin()));
    ASSERT_TRUE(second.Hello(pass, phone));
    EXPECT_THAT(RefusedWith(second), HasSubstr("another phone is the camera now"));
  }
  // Its network broke, and it is back before anybody noticed.
  WearerClient<> again(port());
  ASSERT_TRUE(again.Upgrade(origin()));
  ASSERT_TRUE(again.Hello(token, "phone-1"));
  ASSERT_TRUE(again.Await(Down::kWelcome).has_value());
  EXPECT_THAT(RefusedWith(first), HasSubstr("this phone came back"));
  FakePhone phone;
  SendPicture(again, phone, 9, true);
  EXPECT_EQ(NextNumber(), 9);
}

TEST_F(WearerSocketTest, WhenAPhoneLeavesAnotherMayCome) {
  {
    WearerClient<> first(port());
    ASSERT_TRUE(first.Upgrade(origin()));
    ASSERT_TRUE(first.Hello(PassOf(AccessRole::kWearer), "phone-1"));
    ASSERT_TRUE(first.Await(Down::kWelcome).has_value());
  }
  const std::string token = PassOf(AccessRole::kWearer);
  EXPECT_TRUE(Soon([&] {
    WearerClient<> second(port());
    if (!second.Upgrade(origin()) || !second.Hello(token, "phone-2")) return false;
    const auto answer = second.Read();
    return answer && answer->has_welcome();
  }));
}

TEST_F(WearerSocketTest, RevokedIsOutWithinASecond) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  FakePhone phone;
  SendPicture(client, phone, 1, true);
  EXPECT_EQ(NextNumber(), 1);
  const Timestamp begin_ns = MonotonicNow();
  access_->Revoke(invite_id_, [](const absl::StatusOr<int>& ended) { EXPECT_TRUE(ended.ok()); });
  EXPECT_THAT(RefusedWith(client), HasSubstr("revoked"));
  EXPECT_LT(MonotonicNow() - begin_ns, 1'000'000'000);
  // Nothing that comes after it counts.
  SendPicture(client, phone, 2, true);
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(source_->Find(1), std::nullopt);
}

TEST_F(WearerSocketTest, ThePhoneHearsWhatBecameOfEachPicture) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  FakePhone phone;
  SendPicture(client, phone, 41, true);
  const auto frame = source_->Next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = (*frame)->id;
  TrackedEvent event;
  event.snapshot = snapshot;
  event.stages.tracked_ns = MonotonicNow();
  entrance_->OnTracked(event);
  const auto tracked = client.Await(Down::kTracked);
  ASSERT_TRUE(tracked.has_value());
  EXPECT_EQ(tracked->tracked().picture_id(), 41u);
  EXPECT_EQ(tracked->tracked().pose().frame_id(), (*frame)->id);
  EXPECT_LE(tracked->tracked().received_ns(), tracked->tracked().decoded_ns());
  EXPECT_LE(tracked->tracked().decoded_ns(), tracked->tracked().tracked_ns());
}

TEST_F(WearerSocketTest, PingsAreAnsweredAndSetTheClock) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  const auto phone_now = [] { return MonotonicNow() + FakePhone::kAhead_ns; };
  std::int64_t server_ns = 0, arrived_ns = 0;
  for (int i = 0; i < 3; ++i) {
    v1::WearerUpstream ping;
    ping.mutable_ping()->set_sent_ns(phone_now());
    ping.mutable_ping()->set_echo_server_ns(server_ns);
    ping.mutable_ping()->set_echo_arrived_ns(arrived_ns);
    ASSERT_TRUE(client.Send(ping));
    const auto pong = client.Await(Down::kPong);
    ASSERT_TRUE(pong.has_value());
    EXPECT_EQ(pong->pong().echo_sent_ns(), ping.ping().sent_ns());
    server_ns = pong->pong().server_ns();
    arrived_ns = phone_now();
  }
  FakePhone phone;
  const Timestamp taken_ns = MonotonicNow();
  CodedPicture coded = phone.Code(1, true);
  std::this_thread::sleep_for(milliseconds(150));  // a slow way: not to be seen in the time
  v1::WearerUpstream message;
  message.mutable_picture()->set_codec(v1::WEARER_CODEC_H264);
  message.mutable_picture()->set_key_frame(true);
  message.mutable_picture()->set_capture_ns(taken_ns + FakePhone::kAhead_ns);
  message.mutable_picture()->set_data(coded.data);
  ASSERT_TRUE(client.Send(message));
  const auto frame = source_->Next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_NEAR(static_cast<double>((*frame)->capture_time_ns - taken_ns), 0, 20e6);
}

TEST_F(WearerSocketTest, WithoutTokensOurOwnPageAloneMay) {
  Open(false);
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(""));
  EXPECT_TRUE(client.Await(Down::kWelcome).has_value());
  EXPECT_EQ(AnswerTo("/wear/upstream", "Origin: http://evil.example"), 403);
}

TEST_F(WearerSocketTest, AServerWithAnotherCameraSaysSo) {
  Open(true, {}, /*with_phone=*/false);
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  EXPECT_THAT(RefusedWith(client), HasSubstr("another camera, sim:desk"));
}

TEST_F(WearerSocketTest, TheGatewayStopsWithAPhoneConnected) {
  WearerClient<> client(port());
  ASSERT_TRUE(client.Upgrade(origin()));
  ASSERT_TRUE(client.Hello(PassOf(AccessRole::kWearer)));
  ASSERT_TRUE(client.Await(Down::kWelcome).has_value());
  auto stopped = std::async(std::launch::async, [&] { gateway_->Stop(); });
  EXPECT_EQ(stopped.wait_for(std::chrono::seconds(2)), std::future_status::ready);
  EXPECT_TRUE(client.Ended());
}

}  // namespace
}  // namespace saccade::wearer_socket_test
