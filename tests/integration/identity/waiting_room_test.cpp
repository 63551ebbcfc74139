// Who comes by a link waits until somebody lets them in, or sends them away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "saccade/v1/session.pb.h"
#include "tests/integration/identity/guarded_server.hpp"
#include "tests/integration/identity/https_client.hpp"

namespace saccade::testing::waiting_room_test {
namespace {

using ::testing::HasSubstr;

constexpr int kNotFound = 5, kPermissionDenied = 7, kUnauthenticated = 16;
const std::string kJoin = "saccade.v1.SessionService/Join";

class WaitingRoom : public ::testing::Test {
 protected:
  template <typename Request, typename Response>
  grpc::Status Ask(grpc::Status (v1::AccessService::Stub::*method)(grpc::ClientContext*,
                                                                   const Request&, Response*),
                   const Request& request, Response& response, const std::string& token) {
    const auto stub = v1::AccessService::NewStub(server_.channel());
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    return ((*stub).*method)(&context, request, &response);
  }
  /// Of a new invite of the waiting server; `name` as who comes calls themselves.
  v1::RedeemResponse Come(v1::AccessRole role, const std::string& name) {
    v1::RedeemRequest request;
    request.set_invite(server_.Invite(role));
    request.set_display_name(name);
    v1::RedeemResponse response;
    EXPECT_TRUE(Ask(&v1::AccessService::Stub::Redeem, request, response, "").ok());
    return response;
  }
  v1::GetAccessResponse Access(const std::string& token) {
    v1::GetAccessResponse response;
    EXPECT_TRUE(Ask(&v1::AccessService::Stub::GetAccess, {}, response, token).ok());
    return response;
  }
  v1::ListWaitingResponse Waiting(const std::string& token) {
    v1::ListWaitingResponse response;
    EXPECT_TRUE(Ask(&v1::AccessService::Stub::ListWaiting, {}, response, token).ok());
    return response;
  }
  int Admit(const std::string& id, bool refuse, const std::string& token) {
    v1::AdmitRequest request;
    request.set_id(id);
    request.set_refuse(refuse);
    v1::AdmitResponse response;
    return Ask(&v1::AccessService::Stub::Admit, request, response, token).error_code();
  }
  RunResult Owner(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), SACCADE_PROGRAM);
    arguments.insert(arguments.end(), {"--data-dir", server_.data_dir()});
    return RunProgram(arguments, std::chrono::seconds(20),
                      {"XDG_STATE_HOME=" + (home_ / "state"), "XDG_DATA_HOME=" + (home_ / "data")});
  }

  TemporaryFolder home_;
  GuardedServer server_{GuardedServer::Options{.flags = {"--waiting-room"}}};
};

TEST_F(WaitingRoom, OpensNothingUntilTheWearerLetsIn) {
  const v1::RedeemResponse wearer = Come(v1::ACCESS_ROLE_WEARER, "Wanda");
  EXPECT_FALSE(wearer.waiting()) << "else nobody could let anybody in";
  const v1::RedeemResponse expert = Come(v1::ACCESS_ROLE_PILOT, "Ada");
  EXPECT_TRUE(expert.waiting());
  EXPECT_TRUE(Access(expert.token()).waiting());
  for (const char* method : {"SessionService/Join", "SessionService/GetStatus", "MapService/Get",
                             "AnnotationService/List", "AccessService/ListWaiting"}) {
    const std::string full = std::string("saccade.v1.") + method;
    const Outcome grpc = server_.Call(full, "", expert.token());
    EXPECT_EQ(grpc.code, kPermissionDenied) << method;
    EXPECT_THAT(grpc.message, HasSubstr("you wait to be let in"));
    EXPECT_EQ(
        CallOverWeb(server_.http_port(), server_.root_pem(), full, "", expert.token()).grpc_status,
        kPermissionDenied);
  }
  const v1::ListWaitingResponse people = Waiting(wearer.token());
  ASSERT_EQ(people.people_size(), 1);
  EXPECT_EQ(people.people(0).display_name(), "Ada");
  EXPECT_EQ(people.people(0).role(), v1::ACCESS_ROLE_PILOT);
  EXPECT_EQ(Admit(people.people(0).id(), false, expert.token()), kPermissionDenied)
      << "nobody lets themselves in";
  EXPECT_EQ(Admit(people.people(0).id(), false, wearer.token()), 0);
  EXPECT_FALSE(Access(expert.token()).waiting());
  EXPECT_EQ(server_.Call(kJoin, "", expert.token()).code, 0);
  EXPECT_EQ(Waiting(wearer.token()).people_size(), 0);
  EXPECT_EQ(Admit(people.people(0).id(), true, wearer.token()), kNotFound) << "is in";
}

TEST_F(WaitingRoom, WhoIsSentAwayIsToldSo) {
  const std::string pass = Come(v1::ACCESS_ROLE_VIEWER, "Eve").token();
  const std::string id = Waiting(server_.owner_token()).people(0).id();
  EXPECT_EQ(Admit(id, true, server_.owner_token()), 0);
  const Outcome refused = server_.Call(kJoin, "", pass);
  EXPECT_EQ(refused.code, kUnauthenticated);
  EXPECT_THAT(refused.message, HasSubstr("you were not let in; ask for a new one"));
  EXPECT_THAT(Access(pass).refusal(), HasSubstr("you were not let in"));
}

TEST_F(WaitingRoom, TheCommandLineGoesByNames) {
  EXPECT_EQ(Owner({"waiting"}).out, "nobody waits\n");
  const std::string ada = Come(v1::ACCESS_ROLE_PILOT, "Ada").token();
  const std::string eve = Come(v1::ACCESS_ROLE_PILOT, "Eve").token();
  const RunResult waiting = Owner({"waiting"});
  EXPECT_THAT(waiting.out, HasSubstr("Ada"));
  EXPECT_THAT(waiting.out, HasSubstr("Eve"));
  const RunResult nobody = Owner({"admit", "Mallory"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("nobody called Mallory waits"));
  EXPECT_EQ(Owner({"admit", "Ada"}).out, "Ada is in as pilot\n");
  EXPECT_EQ(Owner({"admit", "Eve", "--refuse"}).out, "Eve was sent away\n");
  EXPECT_EQ(server_.Call(kJoin, "", ada).code, 0);
  EXPECT_EQ(server_.Call(kJoin, "", eve).code, kUnauthenticated);
  EXPECT_THAT(Owner({"audit"}).out, HasSubstr("AccessService/Admit"));
}

TEST(WaitingInvite, OneInviteCanAskForItAlone) {
  GuardedServer server;
  TemporaryFolder home;
  const RunResult made =
      RunProgram({SACCADE_PROGRAM, "invite", "--role", "viewer", "--wait", "--json", "--data-dir",
                  server.data_dir()},
                 std::chrono::seconds(20), {"XDG_STATE_HOME=" + (home / "state")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json invite = nlohmann::json::parse(made.out);
  EXPECT_EQ(invite["waiting_room"], true);
  const std::string link = invite["link"];
  std::string pass;
  EXPECT_EQ(server.Redeem(link.substr(link.find("#invite=") + 8), &pass).code, 0);
  EXPECT_EQ(server.Call(kJoin, "", pass).code, kPermissionDenied);
  EXPECT_EQ(server.Call(kJoin, "", server.PassOf(v1::ACCESS_ROLE_VIEWER)).code, 0)
      << "others do not wait";
}

TEST(WaitingInvite, NeedsInvites) {
  const RunResult run = RunProgram(
      {SACCADE_SERVER_PROGRAM, "--source", "sim:desk", "--waiting-room"}, std::chrono::seconds(20));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("without invites everybody is in"));
}

}  // namespace
}  // namespace saccade::testing::waiting_room_test
