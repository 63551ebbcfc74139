#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/app/server_config.hpp"
#include "server/identity/access_book.hpp"
#include "server/identity/certificate_files.hpp"
#include "server/identity/identity_provider.hpp"

namespace saccade {

/// Who the server is, and whom it lets in: what both ports share.
///
/// DATA_DIR/owner.json (0600) tells `saccade invite` of this user where the server is and with what
/// token it obeys; it is there while the server runs and tokens are asked for.
class FrontDoor {
 public:
  /// Makes certificates and opens the book of invites where they are wanted. Errors as
  /// EnsureServerIdentity, LoadServerIdentity and AccessBook::Open.
  static absl::StatusOr<std::unique_ptr<FrontDoor>> Open(const ServerConfig& config);
  ~FrontDoor();

  /// Looks every ten seconds whether there is another certificate: the given files were changed, or
  /// the own one expires, or this machine has a new name or address; `on_new` hears of it, on a
  /// thread of this object's, and again ten seconds later if it fails. Null: no more. Does nothing
  /// where nobody speaks TLS.
  using OnNew = std::function<absl::Status(const ServerIdentity&)>;
  void Watch(OnNew on_new);

  /// Nothing: `address` speaks plain.
  std::optional<ServerIdentity> TlsOf(const Address& address) const;
  AccessBook& access() { return *access_; }
  /// Null: nobody signs in.
  IdentityProvider* provider() { return provider_.get(); }
  bool insecure() const;  // plain beyond loopback
  /// Names that browsers may use besides the machine's own.
  const std::vector<std::string>& allowed_hosts() const { return allowed_hosts_; }

  /// Any thread, once the ports are known.
  std::string LinkOf(AccessRole role, const std::string& token) const;
  /// Writes owner.json and says on the console how people come in: on a terminal with links and a
  /// QR code; elsewhere, as logs are read by many, only how to make them.
  absl::Status Announce(int grpc_port, int http_port);

 private:
  explicit FrontDoor(const ServerConfig& config) : config_(config) {}
  std::string BaseUrl(int http_port) const;
  absl::StatusOr<ServerIdentity> Identify() const;
  void Look(const OnNew& on_new);
  void SayExpiry();
  absl::Status WriteOwner() const;
  void SayInvites();
  const char* WearerPath() const;  // of the page that is theirs

  const ServerConfig config_;
  std::optional<ServerIdentity> identity_;
  std::unique_ptr<AccessBook> access_;
  std::unique_ptr<IdentityProvider> provider_;
  std::vector<std::string> allowed_hosts_;
  std::string base_url_;  // before the first call is served
  bool wrote_owner_ = false;
  std::string served_chain_;   // of the watch, once it runs
  std::string said_;           // the last trouble with a certificate
  std::int64_t said_day_ = 0;  // on which the end of one was told
  std::string owner_grpc_;     // where this machine reaches the server
  std::jthread watch_;
};

}  // namespace saccade
