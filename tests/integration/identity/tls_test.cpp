// Both ports against a client that means ill, or is old.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include <chrono>
#include <thread>

#include "server/identity/certificate.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::tls_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Tls : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new GuardedServer; }
  static void TearDownTestSuite() { delete server_; }
  static HttpsRequest Request() {
    HttpsRequest request;
    request.port = server_->http_port();
    request.root_pem = server_->root_pem();
    return request;
  }
  static GuardedServer* server_;
};
GuardedServer* Tls::server_ = nullptr;

TEST_F(Tls, BothPortsSpeakVersion13AndNoOlder) {
  for (const int port : {server_->grpc_port(), server_->http_port()}) {
    bool verified = false;
    EXPECT_TRUE(Handshake(port, server_->root_pem(), TLS1_3_VERSION, &verified)) << port;
    EXPECT_TRUE(verified) << port;
    EXPECT_FALSE(Handshake(port, server_->root_pem(), TLS1_2_VERSION)) << port;
    EXPECT_FALSE(Handshake(port, server_->root_pem(), TLS1_1_VERSION)) << port;
  }
}

TEST_F(Tls, AnotherAuthorityVouchesForNothingHere) {
  const auto other = MakeAuthority("another");
  ASSERT_TRUE(other.ok());
  for (const int port : {server_->grpc_port(), server_->http_port()}) {
    bool verified = true;
    EXPECT_TRUE(Handshake(port, other->certificate_pem, TLS1_3_VERSION, &verified));
    EXPECT_FALSE(verified) << port;
  }
}

TEST_F(Tls, APlainGrpcClientGetsNothing) {
  const auto channel = grpc::CreateChannel(server_->grpc(), grpc::InsecureChannelCredentials());
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(3));
  v1::GetAccessResponse response;
  const grpc::Status status =
      v1::AccessService::NewStub(channel)->GetAccess(&context, {}, &response);
  EXPECT_FALSE(status.ok());
}

TEST_F(Tls, ThePageComesByHttpsAndItsRootWithIt) {
  HttpsRequest request = Request();
  EXPECT_EQ(Send(request).http_status, 200);
  request.target = "/trust";
  const HttpsReply page = Send(request);
  EXPECT_EQ(page.http_status, 200);
  EXPECT_THAT(page.body, HasSubstr(InspectCertificate(server_->root_pem())->sha256));
  for (const char* words : {"Android", "iPhone", "saccade-root.crt"}) {
    EXPECT_THAT(page.body, HasSubstr(words));
  }
  request.target = "/trust/saccade-root.crt";
  const HttpsReply root = Send(request);
  EXPECT_EQ(root.body, server_->root_pem());
  EXPECT_THAT(root.head, HasSubstr("application/x-x509-ca-cert"));
}

TEST_F(Tls, AWrongHostOrOriginIsRefused) {
  HttpsRequest request = Request();
  request.host = "evil.example";
  EXPECT_EQ(Send(request).http_status, 421);
  const std::string own = "127.0.0.1:" + std::to_string(server_->http_port());
  for (const std::string& origin :
       {std::string("https://evil.example"), "http://" + own, std::string("null")}) {
    HttpsRequest call = Request();
    call.method = "POST";
    call.target = "/saccade.v1.AccessService/GetAccess";
    call.content_type = "application/grpc-web+proto";
    call.body = std::string(5, '\0');
    call.origin = origin;
    EXPECT_EQ(Send(call).http_status, 403) << origin;
    call.origin = "https://" + own;
    EXPECT_EQ(Send(call).http_status, 200);
  }
}

TEST_F(Tls, SecretsStandInNoLog) {
  const std::string invite = server_->Invite(v1::ACCESS_ROLE_PILOT);
  std::string token;
  ASSERT_EQ(server_->Redeem(invite, &token).code, 0);
  ASSERT_FALSE(server_->Join(token).empty());
  EXPECT_NE(server_->Redeem(invite, nullptr).code, 0) << "used up";
  for (int tries = 0; tries < 100; ++tries) {
    if (server_->process().err().find("used up") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const std::string log = server_->process().err() + server_->process().out();
  EXPECT_THAT(log, HasSubstr("rpc Redeem"));
  for (const std::string& secret : {invite, token, server_->owner_token()}) {
    EXPECT_THAT(log, Not(HasSubstr(secret.substr(secret.find('.') + 1))));
  }
}

}  // namespace
}  // namespace saccade::testing::tls_test
