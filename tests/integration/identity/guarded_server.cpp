#include "tests/integration/identity/guarded_server.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "saccade/v1/session.grpc.pb.h"

namespace saccade::testing {
namespace {

constexpr std::chrono::seconds kDeadline(5);

std::string ReadText(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

void Prepare(grpc::ClientContext& context, const std::string& token) {
  context.set_deadline(std::chrono::system_clock::now() + kDeadline);
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
}

Outcome OutcomeOf(const grpc::Status& status) {
  return {static_cast<int>(status.error_code()), status.error_message()};
}

}  // namespace

GuardedServer::GuardedServer(const Options& options) {
  const std::string toml = folder_ / "server.toml";
  std::ofstream(toml) << options.top << "[tls]\nrequired = " << (options.tls ? "true" : "false")
                      << "\n[auth]\nrequired = true\n[limits]\n"
                      << options.limits << options.last;
  std::filesystem::create_directory(data_dir());
  if (options.prepare) options.prepare(data_dir());
  std::vector<std::string> command = {
      "--source", "sim:desk?width=320&height=240", "--config", toml, "--data-dir", data_dir()};
  command.insert(command.end(), options.flags.begin(), options.flags.end());
  server_ = std::make_unique<Server>(command);
  if (options.tls) root_pem_ = ReadText(data_dir() + "/tls/authority.pem");
  owner_token_ = nlohmann::json::parse(ReadText(data_dir() + "/owner.json")).at("token");
  channel_ = NewChannel();
}

std::shared_ptr<grpc::Channel> GuardedServer::NewChannel() const {
  grpc::ChannelArguments own;
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::SslCredentialsOptions tls;
  tls.pem_root_certs = root_pem_;
  return grpc::CreateCustomChannel(
      server_->grpc(),
      root_pem_.empty() ? grpc::InsecureChannelCredentials() : grpc::SslCredentials(tls), own);
}

int GuardedServer::PortOf(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

std::string GuardedServer::Invite(v1::AccessRole role, std::string* id, std::uint32_t uses) {
  grpc::ClientContext context;
  Prepare(context, owner_token_);
  v1::CreateInviteRequest request;
  request.set_role(role);
  request.set_uses(uses);
  v1::CreateInviteResponse response;
  const grpc::Status status =
      v1::AccessService::NewStub(channel_)->CreateInvite(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  if (id != nullptr) *id = response.invite().id();
  return response.link().substr(response.link().find("#invite=") + 8);
}

Outcome GuardedServer::Redeem(const std::string& invite, std::string* token) {
  grpc::ClientContext context;
  Prepare(context, "");
  v1::RedeemRequest request;
  request.set_invite(invite);
  v1::RedeemResponse response;
  const grpc::Status status =
      v1::AccessService::NewStub(channel_)->Redeem(&context, request, &response);
  if (token != nullptr) *token = response.token();
  return OutcomeOf(status);
}

std::string GuardedServer::PassOf(v1::AccessRole role, std::string* invite_id) {
  std::string token;
  const Outcome redeemed = Redeem(Invite(role, invite_id), &token);
  EXPECT_EQ(redeemed.code, 0) << redeemed.message;
  return token;
}

std::string GuardedServer::Join(const std::string& token) {
  grpc::ClientContext context;
  Prepare(context, token);
  v1::JoinRequest request;
  request.set_role(v1::ROLE_EXPERT);
  v1::JoinResponse response;
  const grpc::Status status =
      v1::SessionService::NewStub(channel_)->Join(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.session_id();
}

Outcome GuardedServer::Revoke(const std::string& invite_id) {
  grpc::ClientContext context;
  Prepare(context, owner_token_);
  v1::RevokeInviteRequest request;
  request.set_id(invite_id);
  v1::RevokeInviteResponse response;
  return OutcomeOf(
      v1::AccessService::NewStub(channel_)->RevokeInvite(&context, request, &response));
}

Outcome GuardedServer::Call(const std::string& method, const std::string& message,
                            const std::string& token) {
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  Prepare(context, token);
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto call = stub.PrepareCall(&context, "/" + method, &queue);
  call->StartCall(nullptr);
  wait();
  const grpc::Slice slice(message);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  wait();
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  const bool answered = wait();
  if (answered) context.TryCancel();  // of a stream the first event says enough
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  queue.Shutdown();
  while (wait()) {
  }
  return answered ? Outcome{0, ""} : OutcomeOf(status);
}

}  // namespace saccade::testing
