// Another wearer's server as a guest: over TLS, by an invite.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "saccade/v1/team.grpc.pb.h"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/test_certificates.hpp"

namespace saccade::testing::team_test {
namespace {

using namespace std::chrono_literals;

int MembersOf(const GuardedServer& server) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 5s);
  context.AddMetadata("authorization", "Bearer " + server.owner_token());
  v1::GetTeamResponse team;
  const grpc::Status status =
      v1::TeamService::NewStub(server.channel())->GetTeam(&context, {}, &team);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return team.members_size();
}

bool ComesToBe(const GuardedServer& server, int members, std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (MembersOf(server) != members) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(100ms);
  }
  return true;
}

std::string Written(const TemporaryFolder& folder, const std::string& name,
                    const std::string& text) {
  std::ofstream(folder / name) << text;
  return folder / name;
}

TEST(TeamLink, ComesInByTlsAndAnInviteAndByTheKeptTokenTheNextTime) {
  GuardedServer ada;
  const TemporaryFolder folder;
  const std::string root = Written(folder, "root.pem", ada.root_pem());
  const std::string link = "https://ada:8443/#invite=" + ada.Invite(v1::ACCESS_ROLE_PILOT);
  const auto bob = [&](const std::string& trust) {
    return std::make_unique<Server>(std::vector<std::string>{
        "--source", "sim:desk?width=320&height=240", "--data-dir", folder / "bob", "--team",
        ada.grpc(), "--team-trust", trust, "--team-invite", link});
  };
  std::filesystem::create_directory(folder / "bob");
  {
    const TestAuthority other("nobody that Ada knows");
    const auto stranger = bob(Written(folder, "other.pem", other.pem()));
    std::this_thread::sleep_for(3s);
    EXPECT_EQ(MembersOf(ada), 0) << "a certificate that its root does not vouch for";
  }
  for (const char* when : {"by the invite, that is good for one use", "by the token it gave"}) {
    const auto member = bob(root);
    EXPECT_TRUE(ComesToBe(ada, 1, 20s)) << when;
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(folder / "bob") / "team_token"));
  }
}

}  // namespace
}  // namespace saccade::testing::team_test
