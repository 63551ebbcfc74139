// Mutual TLS: a machine's certificate is an identity, with the role that the server's file says.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>

#include "saccade/v1/access.grpc.pb.h"
#include "saccade/v1/map.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/test_certificates.hpp"

namespace saccade::testing::machines_test {
namespace {

using ::testing::HasSubstr;

constexpr int kUnavailable = 14, kPermissionDenied = 7, kUnauthenticated = 16;
constexpr int kDay_s = 86'400;

class Machines : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ca_ = new TestAuthority("Firm's machines");
    folder_ = new TemporaryFolder;
    std::ofstream(*folder_ / "ca.pem") << ca_->pem();
    server_ = new GuardedServer(GuardedServer::Options{
        .last = "[client_roles]\n\"robot-7\" = \"pilot\"\n\"spiffe://firm/desk\" = \"annotator\"\n",
        .flags = {"--client-ca", *folder_ / "ca.pem"}});
  }
  static void TearDownTestSuite() {
    delete server_;
    delete folder_;
    delete ca_;
  }
  /// As what a machine with this certificate is known; its status where it is not.
  struct Answer {
    int code = -1;
    v1::AccessRole role = v1::ACCESS_ROLE_UNSPECIFIED;
    int reset = -1;  // of MapService/Reset, which takes a pilot's session
    int status = -1, invites = -1;
  };
  static std::shared_ptr<grpc::Channel> Channel(const TestPair& own) {
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = server_->root_pem();
    tls.pem_cert_chain = own.certificate_pem;
    tls.pem_private_key = own.key_pem;
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(server_->grpc(), grpc::SslCredentials(tls), arguments);
  }
  static void Prepare(grpc::ClientContext& context, const std::string& token) {
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  }
  static Answer Try(const TestPair& own, const std::string& token = "") {
    const auto channel = Channel(own);
    const auto access = v1::AccessService::NewStub(channel);
    Answer answer;
    {
      grpc::ClientContext context;
      Prepare(context, token);
      v1::GetAccessResponse response;
      answer.code = access->GetAccess(&context, {}, &response).error_code();
      answer.role = response.role();
    }
    {
      grpc::ClientContext context;
      Prepare(context, token);
      v1::GetStatusResponse response;
      answer.status =
          v1::SessionService::NewStub(channel)->GetStatus(&context, {}, &response).error_code();
    }
    {
      grpc::ClientContext context;
      Prepare(context, token);
      v1::ResetMapResponse response;
      answer.reset = v1::MapService::NewStub(channel)->Reset(&context, {}, &response).error_code();
    }
    {
      grpc::ClientContext context;
      Prepare(context, token);
      v1::ListInvitesResponse response;
      answer.invites = access->ListInvites(&context, {}, &response).error_code();
    }
    return answer;
  }

  static TestAuthority* ca_;
  static TemporaryFolder* folder_;
  static GuardedServer* server_;
};
TestAuthority* Machines::ca_ = nullptr;
TemporaryFolder* Machines::folder_ = nullptr;
GuardedServer* Machines::server_ = nullptr;

TEST_F(Machines, ACertificateIsAnIdentityWithItsRole) {
  const Answer pilot = Try(ca_->Issue("robot-7", "", kDay_s));
  EXPECT_EQ(pilot.role, v1::ACCESS_ROLE_PILOT);
  EXPECT_EQ(pilot.status, 0);
  EXPECT_NE(pilot.reset, kPermissionDenied) << "only the session is missing";
  EXPECT_EQ(pilot.invites, kPermissionDenied);
  const Answer by_uri = Try(ca_->Issue("whatever", "spiffe://firm/desk", kDay_s));
  EXPECT_EQ(by_uri.role, v1::ACCESS_ROLE_ANNOTATOR);
  EXPECT_EQ(by_uri.reset, kPermissionDenied);
  const Answer other = Try(ca_->Issue("robot-8", "", kDay_s));
  EXPECT_EQ(other.role, v1::ACCESS_ROLE_VIEWER) << "not in the file";
  EXPECT_EQ(other.status, 0);
}

TEST_F(Machines, AnotherAuthoritysOrAnExpiredOneEndsTheHandshake) {
  const TestAuthority other("Firm's machines");  // of the same name
  EXPECT_EQ(Try(other.Issue("robot-7", "", kDay_s)).status, kUnavailable);
  EXPECT_EQ(Try(ca_->Issue("robot-7", "", -1)).status, kUnavailable);
  EXPECT_EQ(Try(ca_->Issue("robot-7", "", -1), server_->owner_token()).status, kUnavailable)
      << "a token does not mend it";
}

TEST_F(Machines, WithoutACertificateATokenIsNeededAsEver) {
  EXPECT_EQ(Try({}).status, kUnauthenticated);
  const Answer viewer = Try({}, server_->PassOf(v1::ACCESS_ROLE_VIEWER));
  EXPECT_EQ(viewer.role, v1::ACCESS_ROLE_VIEWER);
  EXPECT_EQ(viewer.status, 0);
  // Whoever shows both is who the token says.
  const Answer both =
      Try(ca_->Issue("robot-7", "", kDay_s), server_->PassOf(v1::ACCESS_ROLE_VIEWER));
  EXPECT_EQ(both.role, v1::ACCESS_ROLE_VIEWER);
  EXPECT_EQ(both.reset, kPermissionDenied);
}

TEST(ClientCa, IsCheckedAtTheStart) {
  TemporaryFolder folder;
  std::ofstream(folder / "server.toml") << "[tls]\nrequired = true\n[auth]\nrequired = true\n";
  const auto run = [&](const std::string& ca, const std::string& config) {
    std::vector<std::string> command = {SACCADE_SERVER_PROGRAM,
                                        "--source",
                                        "sim:desk?width=320&height=240",
                                        "--grpc",
                                        "127.0.0.1:0",
                                        "--http",
                                        "127.0.0.1:0",
                                        "--run-for",
                                        "1",
                                        "--data-dir",
                                        folder / "data",
                                        "--client-ca",
                                        ca};
    if (!config.empty()) command.insert(command.end(), {"--config", config});
    return RunProgram(command, std::chrono::seconds(30));
  };
  const RunResult plain = run(folder / "ca.pem", "");
  EXPECT_EQ(plain.exit_code, 2);
  EXPECT_THAT(plain.err, HasSubstr("--client-ca: machines show certificates where there is TLS"));
  const RunResult missing = run(folder / "none.pem", folder / "server.toml");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("tls.client_ca"));
}

}  // namespace
}  // namespace saccade::testing::machines_test
