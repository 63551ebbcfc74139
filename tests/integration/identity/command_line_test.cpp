// saccade trust, invite, invites, revoke, and every other command over TLS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/identity/certificate.hpp"
#include "tests/integration/identity/guarded_server.hpp"

namespace saccade::testing::command_line_test {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

std::string ReadText(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

class GuardedCommandLine : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new GuardedServer; }
  static void TearDownTestSuite() { delete server_; }

  /// Of another person: nothing is kept but by earlier calls of the same test.
  RunResult Saccade(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), SACCADE_PROGRAM);
    return RunProgram(arguments, seconds(20),
                      {"XDG_STATE_HOME=" + home_ / "state", "XDG_DATA_HOME=" + home_ / "data"});
  }
  RunResult Owner(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--data-dir", server_->data_dir()});
    return Saccade(std::move(arguments));
  }

  static GuardedServer* server_;
  TemporaryFolder home_;
};
GuardedServer* GuardedCommandLine::server_ = nullptr;

TEST_F(GuardedCommandLine, ExportsTheRootOfAFolderAndOfAServer) {
  const RunResult folder = Owner({"trust"});
  EXPECT_EQ(folder.exit_code, 0) << folder.err;
  EXPECT_EQ(folder.out, server_->root_pem());
  const std::string file = home_ / "root.pem";
  const RunResult fetched = Saccade({"trust", "--from", server_->http(), "--out", file});
  EXPECT_EQ(fetched.exit_code, 0) << fetched.err;
  EXPECT_EQ(ReadText(file), server_->root_pem());
  EXPECT_EQ(fetched.out, InspectCertificate(server_->root_pem())->sha256 + "\n");
  EXPECT_EQ(Owner({"trust", "--fingerprint"}).out, fetched.out);
  const RunResult none = Saccade({"trust"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("--from HOST:HTTP_PORT"));
}

TEST_F(GuardedCommandLine, AnInviteLetsInOverTlsUntilItIsRevoked) {
  const RunResult made = Owner({"invite", "--role", "annotator", "--life", "2h", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json invite = nlohmann::json::parse(made.out);
  EXPECT_EQ(invite["state"], "open");
  const std::string link = invite["link"], id = invite["id"];
  EXPECT_THAT(link, ::testing::StartsWith("https://127.0.0.1:"));
  const std::string root = home_ / "root.pem";
  ASSERT_EQ(Saccade({"trust", "--from", link, "--out", root}).exit_code, 0);

  const RunResult stranger = Saccade({"--server", server_->grpc(), "--trust", root, "status"});
  EXPECT_EQ(stranger.exit_code, 1);
  EXPECT_THAT(stranger.err, HasSubstr("invite"));
  const RunResult first =
      Saccade({"--server", server_->grpc(), "--trust", root, "--invite", link, "status"});
  EXPECT_EQ(first.exit_code, 0) << first.err;
  // Kept: neither root nor invite are named again.
  const RunResult second = Saccade({"--server", server_->grpc(), "annotations"});
  EXPECT_EQ(second.exit_code, 0) << second.err;
  const RunResult beyond = Saccade({"--server", server_->grpc(), "home"});
  EXPECT_EQ(beyond.exit_code, 1);
  EXPECT_THAT(beyond.err, HasSubstr("takes the role pilot, and yours is annotator"));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(home_ / "state")) {
    struct stat facts {};
    ASSERT_EQ(stat(entry.path().c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 077u, 0u) << entry.path();
  }

  const RunResult listed = Owner({"invites"});
  EXPECT_THAT(listed.out, HasSubstr(id));
  EXPECT_THAT(listed.out, HasSubstr("used up"));
  const RunResult revoked = Owner({"revoke", id});
  EXPECT_EQ(revoked.exit_code, 0) << revoked.err;
  EXPECT_THAT(revoked.out, HasSubstr("1 pass ended"));
  const RunResult out = Saccade({"--server", server_->grpc(), "status"});
  EXPECT_EQ(out.exit_code, 1);
  EXPECT_THAT(out.err, HasSubstr("this invite was revoked; ask for a new one"));
  EXPECT_EQ(Owner({"revoke", "i000000000000"}).exit_code, 1);
}

TEST_F(GuardedCommandLine, TheOwnersOwnCommandsNeedNothingButTheFolder) {
  const RunResult status = Owner({"--server", server_->grpc(), "status"});
  EXPECT_EQ(status.exit_code, 0) << status.err;
}

TEST_F(GuardedCommandLine, TheAuditSaysWhoDidWhatAndByWhichInvite) {
  const nlohmann::json invite =
      nlohmann::json::parse(Owner({"invite", "--role", "annotator", "--json"}).out);
  const std::string root = server_->data_dir() + "/tls/authority.pem";
  const RunResult ann =
      Saccade({"--server", server_->grpc(), "--trust", root, "--invite", invite["link"], "--name",
               "Ann", "annotate", "--point", "0,0,1", "--text", "her secret"});
  EXPECT_EQ(ann.exit_code, 0) << ann.err;
  EXPECT_EQ(Saccade({"--server", server_->grpc(), "--name", "Ann", "home"}).exit_code, 1);
  const RunResult audit = Owner({"audit", "--json"});
  ASSERT_EQ(audit.exit_code, 0) << audit.err;
  std::vector<std::string> did;
  for (const nlohmann::json& entry : nlohmann::json::parse(audit.out)) {
    if (entry["invite_id"] != invite["id"]) continue;
    const std::string outcome = entry["outcome"];
    did.push_back(entry["display_name"].get<std::string>() + " " +
                  entry["call"].get<std::string>() + " " + outcome.substr(0, outcome.find(':')));
  }
  EXPECT_THAT(
      did, ::testing::IsSupersetOf({"Ann SessionService/Join ok", "Ann AnnotationService/Create ok",
                                    " GazeService/AcquireLease PERMISSION_DENIED"}));
  EXPECT_THAT(audit.out, HasSubstr("CreateInvite"));
  EXPECT_THAT(audit.out, ::testing::Not(HasSubstr("her secret")));
  EXPECT_THAT(Owner({"audit"}).out, HasSubstr("AnnotationService/Create"));
}

TEST_F(GuardedCommandLine, WhoDoesNotTrustTheRootIsToldWhatToDo) {
  const RunResult result = Saccade({"--server", server_->grpc(), "--tls", "status"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("saccade trust --from"));
  const RunResult plain = Saccade({"--server", server_->grpc(), "--plain", "status"});
  EXPECT_EQ(plain.exit_code, 1);
  EXPECT_THAT(plain.err, HasSubstr("--trust FILE"));
}

std::unique_ptr<Process> ServeOnATerminal(const std::string& folder) {
  std::ofstream(folder + "/server.toml") << "[tls]\nrequired = true\n[auth]\nrequired = true\n";
  const std::string command = std::string(SACCADE_SERVER_PROGRAM) +
                              " --source 'sim:desk?width=320&height=240' --grpc 127.0.0.1:0 "
                              "--http 127.0.0.1:0 --run-for 40 --config " +
                              folder + "/server.toml --data-dir " + folder + "/data";
  return std::make_unique<Process>(
      std::vector<std::string>{"/usr/bin/script", "-qefc", command, "/dev/null"});
}

// A log is read by many: there the server says how links are made. A terminal is its owner's.
TEST_F(GuardedCommandLine, ATerminalIsShownLinksAndAQrCodeAndALogIsNot) {
  EXPECT_THAT(server_->process().err(), HasSubstr("saccade invite --role pilot"));
  EXPECT_THAT(server_->process().err(), ::testing::Not(HasSubstr("#invite=")));
  const auto terminal = ServeOnATerminal(home_.path());
  ASSERT_TRUE(terminal->WaitForLine("\"ready\"", seconds(30)).has_value()) << terminal->out();
  const std::string shown = terminal->out();
  EXPECT_THAT(shown, HasSubstr("/wearer#invite="));
  EXPECT_THAT(shown, HasSubstr("Expert (once, 8 h)"));
  EXPECT_THAT(shown, HasSubstr("\u2580")) << "half a block of the code";
  terminal->Signal(SIGTERM);
  terminal->Wait(seconds(5));
}

TEST(Loopback, NeedsNeitherCertificatesNorInvites) {
  TemporaryFolder folder;
  Server server({"--source", "sim:desk?width=320&height=240", "--data-dir", folder / "data"});
  const RunResult status =
      RunProgram({SACCADE_PROGRAM, "--server", server.grpc(), "status"}, seconds(20),
                 {"XDG_STATE_HOME=" + folder / "state", "XDG_DATA_HOME=" + folder / "home"});
  EXPECT_EQ(status.exit_code, 0) << status.err;
  for (const char* name : {"tls", "owner.json", "access.sqlite"}) {
    EXPECT_FALSE(std::filesystem::exists(folder / ("data/" + std::string(name)))) << name;
  }
  EXPECT_THAT(server.process().err(), ::testing::Not(HasSubstr("invite")));
  EXPECT_THAT(server.process().err(), ::testing::Not(HasSubstr("INSECURE")));
}

/// On loopback and the simulator; `toml`: its file.
std::unique_ptr<Server> Serve(const TemporaryFolder& folder, std::vector<std::string> options,
                              const std::string& toml) {
  std::ofstream(folder / "server.toml") << toml;
  options.insert(options.end(), {"--source", "sim:desk?width=320&height=240", "--config",
                                 folder / "server.toml", "--data-dir", folder / "data"});
  return std::make_unique<Server>(options);
}

// A given certificate is not called 127.0.0.1. Its authority is known to nobody here: --trust.
TEST(GivenCertificate, TheOwnerStillInvites) {
  TemporaryFolder folder;
  const auto authority = MakeAuthority("Somebody's");
  ASSERT_TRUE(authority.ok());
  const auto pair = MakeServerCertificate(*authority, {{"saccade.example"}, {}});
  ASSERT_TRUE(pair.ok());
  std::ofstream(folder / "chain.pem") << pair->certificate_pem;
  std::ofstream(folder / "key.pem") << pair->key_pem;
  std::ofstream(folder / "root.pem") << authority->certificate_pem;
  const auto server =
      Serve(folder, {"--tls-certificate", folder / "chain.pem", "--tls-key", folder / "key.pem"},
            "[auth]\nrequired = true\n");
  const RunResult invite = RunProgram(
      {SACCADE_PROGRAM, "invite", "--role", "viewer", "--trust", folder / "root.pem", "--data-dir",
       folder / "data"},
      seconds(20), {"XDG_STATE_HOME=" + folder / "state", "XDG_DATA_HOME=" + folder / "home"});
  EXPECT_EQ(invite.exit_code, 0) << invite.err;
  EXPECT_THAT(invite.out, HasSubstr("#invite="));
}

// A proxy brings others to loopback.
TEST(PublicUrl, AsksForInvitesOnLoopbackToo) {
  TemporaryFolder folder;
  const auto server = Serve(folder, {"--public-url", "https://saccade.example"}, "");
  const RunResult status =
      RunProgram({SACCADE_PROGRAM, "--server", server->grpc(), "status"}, seconds(20),
                 {"XDG_STATE_HOME=" + folder / "state", "XDG_DATA_HOME=" + folder / "home"});
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_THAT(status.err, HasSubstr("invite"));
}

TEST(DataFolder, ThatOthersCanChangeLetsNobodyIn) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "data");
  ASSERT_EQ(chmod((folder / "data").c_str(), 0777), 0);
  std::ofstream(folder / "server.toml") << "[auth]\nrequired = true\n";
  const RunResult run =
      RunProgram({SACCADE_SERVER_PROGRAM, "--source", "sim:desk?width=320&height=240", "--grpc",
                  "127.0.0.1:0", "--http", "127.0.0.1:0", "--run-for", "1", "--config",
                  folder / "server.toml", "--data-dir", folder / "data"},
                 seconds(30));
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("other accounts of this machine can change it"));
}

// Who compares one fingerprint trusts one certificate.
TEST(Trust, ASecondCertificateBehindTheRootIsRefused) {
  TemporaryFolder folder;
  const auto good = MakeAuthority("Ours"), evil = MakeAuthority("Theirs");
  ASSERT_TRUE(good.ok() && evil.ok());
  std::filesystem::create_directories(folder / "data/tls");
  std::ofstream(folder / "data/tls/authority.pem") << good->certificate_pem;
  const std::vector<std::string> trust = {SACCADE_PROGRAM, "trust", "--data-dir", folder / "data"};
  EXPECT_EQ(RunProgram(trust, seconds(20)).out, good->certificate_pem);
  std::ofstream(folder / "data/tls/authority.pem", std::ios::app) << evil->certificate_pem;
  const RunResult both = RunProgram(trust, seconds(20));
  EXPECT_EQ(both.exit_code, 1);
  EXPECT_EQ(both.out, "");
  EXPECT_THAT(both.err, HasSubstr("more than one certificate"));
}

TEST_F(GuardedCommandLine, StrangersFillNoAudit) {
  for (int k = 0; k < 5; ++k) {
    EXPECT_NE(server_->Call("saccade.v1.SessionService/Join", "", "").code, 0);
  }
  const RunResult audit = Owner({"audit", "--json"});
  ASSERT_EQ(audit.exit_code, 0) << audit.err;
  EXPECT_THAT(audit.out, ::testing::Not(HasSubstr("UNAUTHENTICATED")));
}

// Somebody else with an account on this machine: the folder is closed, and the port wants a token.
TEST_F(GuardedCommandLine, ASecondUserOfTheMachineGetsNothing) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root to become somebody else";
  const auto as_nobody = [&](const std::string& command) {
    return RunProgram({"/usr/bin/setpriv", "--reuid=65534", "--regid=65534", "--clear-groups",
                       "/bin/sh", "-c", command},
                      seconds(20));
  };
  for (const char* name : {"owner.json", "access.sqlite", "tls/server.key", "tls/authority.key"}) {
    const RunResult read = as_nobody("cat " + server_->data_dir() + "/" + name);
    EXPECT_NE(read.exit_code, 0) << name;
    EXPECT_EQ(read.out, "") << name;
  }
  const Outcome call = server_->Call("saccade.v1.SessionService/GetStatus", "", "");
  EXPECT_EQ(call.code, 16) << "as anybody who reaches the port: " << call.message;
}

}  // namespace
}  // namespace saccade::testing::command_line_test
