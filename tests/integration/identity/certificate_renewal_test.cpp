// Another certificate while people watch: who comes sees the new one, who is there sees nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "saccade/v1/session.grpc.pb.h"
#include "server/identity/certificate.hpp"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"
#include "tests/integration/identity/tls_socket.hpp"

namespace saccade::testing::certificate_renewal_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::string Shown(int port, const std::string& root_pem) {
  const TlsSocket socket(port, root_pem, TLS1_3_VERSION, TLS1_3_VERSION);
  return socket.verified() ? socket.PeerCertificate() : "";
}

bool WaitForOther(const std::string& than, int port, const std::string& root_pem) {
  for (const auto end = std::chrono::steady_clock::now() + seconds(30);
       std::chrono::steady_clock::now() < end;) {
    const std::string now = Shown(port, root_pem);
    if (!now.empty() && now != than) return true;
    std::this_thread::sleep_for(milliseconds(200));
  }
  return false;
}

TEST(Renewal, OfTheOwnCertificateDisturbsNoStream) {
  GuardedServer server;
  const std::string pass = server.PassOf(v1::ACCESS_ROLE_VIEWER);
  const auto stub = v1::SessionService::NewStub(server.NewChannel());
  v1::SubscribeRequest request;
  request.set_session_id(server.Join(pass));
  request.set_window(256);
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + pass);
  const auto reader = stub->Subscribe(&context, request);
  std::atomic<int> statistics = 0;
  std::atomic<bool> ended = false;
  std::thread watch([&] {
    for (v1::Event event; reader->Read(&event);) {
      if (event.has_statistics()) ++statistics;
      v1::AcknowledgeRequest acknowledge;
      acknowledge.set_session_id(request.session_id());
      acknowledge.set_sequence(event.sequence());
      grpc::ClientContext own;
      own.AddMetadata("authorization", "Bearer " + pass);
      v1::AcknowledgeResponse response;
      stub->Acknowledge(&own, acknowledge, &response);
    }
    ended = true;
  });
  const int ports[] = {server.grpc_port(), server.http_port()};
  std::string before;
  for (const int port : ports) before = Shown(port, server.root_pem());
  ASSERT_FALSE(before.empty());
  // As if it had come to its last days.
  std::filesystem::remove(server.data_dir() + "/tls/server.pem");
  for (const int port : ports) EXPECT_TRUE(WaitForOther(before, port, server.root_pem())) << port;
  EXPECT_EQ(Shown(ports[0], server.root_pem()), Shown(ports[1], server.root_pem()));
  const int then = statistics;
  for (int tries = 0; tries < 100 && statistics < then + 2; ++tries) {
    std::this_thread::sleep_for(milliseconds(100));
  }
  EXPECT_GE(statistics, then + 2) << "the stream goes on";
  EXPECT_FALSE(ended);
  context.TryCancel();
  watch.join();
  reader->Finish();
}

// In its last month, or moved away by hand: who trusts the new root gets in, also by what this
// machine keeps for itself.
TEST(Renewal, OfTheAuthorityIsTakenUpByBothPortsTheTrustPageAndTheOwner) {
  GuardedServer server;
  const std::string folder = server.data_dir() + "/tls/";
  for (const char* name : {"authority.pem", "authority.key"})
    std::filesystem::remove(folder + name);
  std::string root;
  for (int tries = 0; tries < 150 && root.empty(); ++tries) {
    std::this_thread::sleep_for(milliseconds(200));
    std::ifstream in(folder + "authority.pem");
    root.assign(std::istreambuf_iterator<char>(in), {});
  }
  ASSERT_NE(root, server.root_pem());
  for (const int port : {server.grpc_port(), server.http_port()}) {
    EXPECT_TRUE(WaitForOther("", port, root)) << port;
  }
  const std::string said = "of a new authority: everybody has to trust it anew";
  for (int tries = 0; tries < 50 && server.process().err().find(said) == std::string::npos; ++tries)
    std::this_thread::sleep_for(milliseconds(100));
  EXPECT_THAT(server.process().err(), ::testing::HasSubstr(said));
  HttpsRequest page;
  page.port = server.http_port();
  page.root_pem = root;
  page.target = "/trust/saccade-root.pem";
  EXPECT_EQ(Send(page).body, root);
  std::ifstream owner(server.data_dir() + "/owner.json");
  EXPECT_EQ(nlohmann::json::parse(owner).at("root"), root);
}

TEST(Renewal, OfAGivenCertificateComesWithItsFiles) {
  TemporaryFolder folder;
  const auto authority = MakeAuthority("Somebody's");
  ASSERT_TRUE(authority.ok());
  const auto write = [&] {
    const auto pair = MakeServerCertificate(*authority, {{"localhost"}, {"127.0.0.1"}});
    std::ofstream(folder / "chain.new") << pair->certificate_pem;
    std::ofstream(folder / "key.new") << pair->key_pem;
    std::filesystem::rename(folder / "key.new", folder / "key.pem");
    std::filesystem::rename(folder / "chain.new", folder / "chain.pem");
  };
  write();
  Server server({"--source", "sim:desk?width=320&height=240", "--data-dir", folder / "data",
                 "--tls-certificate", folder / "chain.pem", "--tls-key", folder / "key.pem"});
  const auto port_of = [](const std::string& address) {
    return std::stoi(address.substr(address.rfind(':') + 1));
  };
  const std::string& root = authority->certificate_pem;
  const std::string before = Shown(port_of(server.grpc()), root);
  ASSERT_FALSE(before.empty());
  write();
  EXPECT_TRUE(WaitForOther(before, port_of(server.grpc()), root));
  EXPECT_TRUE(WaitForOther(before, port_of(server.http()), root));
}

}  // namespace
}  // namespace saccade::testing::certificate_renewal_test
