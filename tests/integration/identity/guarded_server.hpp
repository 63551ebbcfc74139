#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "saccade/v1/access.grpc.pb.h"
#include "tests/integration/support/process.hpp"

namespace saccade::testing {

struct Outcome {
  int code = -1;  // gRPC's
  std::string message;
};

/// saccade-server on the simulator, on loopback with TLS and invites, as it is beyond it.
class GuardedServer {
 public:
  struct Options {
    /// Is told the data folder before the server starts.
    std::function<void(const std::string&)> prepare{};
    /// [limits] of its file: none, as every cell of a table at once is more than one person asks
    /// for.
    std::string limits = "scale = 0\n";
    std::string top{}, last{};         // of its file: first lines, last tables
    std::vector<std::string> flags{};  // more of them
    bool tls = true;
  };
  explicit GuardedServer(const Options& options);
  explicit GuardedServer(const std::function<void(const std::string&)>& prepare = nullptr)
      : GuardedServer(Options{.prepare = prepare}) {}

  int grpc_port() const { return PortOf(server_->grpc()); }
  int http_port() const { return PortOf(server_->http()); }
  const std::string& root_pem() const { return root_pem_; }
  const std::string& owner_token() const { return owner_token_; }
  std::string data_dir() const { return folder_ / "data"; }
  const std::string& grpc() const { return server_->grpc(); }
  const std::string& http() const { return server_->http(); }
  Process& process() { return server_->process(); }
  std::shared_ptr<grpc::Channel> channel() const { return channel_; }
  /// A connection of its own.
  std::shared_ptr<grpc::Channel> NewChannel() const;

  /// An invite's token, and the id of the invite.
  std::string Invite(v1::AccessRole role, std::string* id = nullptr, std::uint32_t uses = 1);
  Outcome Redeem(const std::string& invite, std::string* token);
  /// Of a new invite.
  std::string PassOf(v1::AccessRole role, std::string* invite_id = nullptr);
  std::string Join(const std::string& token);
  Outcome Revoke(const std::string& invite_id);

  /// Any method, "saccade.v1.SessionService/Join", with the message as bytes: its first answer or
  /// its status.
  Outcome Call(const std::string& method, const std::string& message, const std::string& token);

 private:
  static int PortOf(const std::string& address);

  TemporaryFolder folder_;
  std::unique_ptr<Server> server_;
  std::string root_pem_, owner_token_;
  std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace saccade::testing
