#include "client/app/entrance.hpp"

#include <memory>

#include "client/cli/access_files.hpp"
#include "client/net/access_client.hpp"

namespace saccade::app {

std::function<absl::StatusOr<bool>(net::ConnectionOptions&)> MakeEntrance(const Options& options,
                                                                          const Address& address) {
  auto access = std::make_shared<cli::Options>();
  access->trust = options.trust;
  access->tls = options.tls;
  access->plain = options.plain || address.plain;
  access->invite = address.invite;
  // http carries no secrets: but an invite of a server on this machine may come by it.
  if (!options.plain && address.plain && !address.invite.empty()) access->plain = false;
  return [access](net::ConnectionOptions& connection) -> absl::StatusOr<bool> {
    access->connection = connection;
    if (absl::Status resolved = cli::ResolveAccess(*access); !resolved.ok()) return resolved;
    access->invite.clear();  // used up: what came of it is kept
    connection = access->connection;
    if (connection.token.empty()) return false;
    return net::AccessClient(connection).Waits();
  };
}

}  // namespace saccade::app
