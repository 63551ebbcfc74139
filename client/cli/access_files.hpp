#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>

#include "client/cli/options.hpp"

namespace saccade::cli {

/// How a server is spoken to: kept between two runs, in files that are this user's alone.
struct KeptAccess {
  std::string server;  // HOST:PORT
  bool tls = false;
  std::string root_pem;  // empty: the system's store
  std::string token;     // empty: none
  std::string name;      // that its certificate has, where it is not `server`'s host
};

/// Of the server that this user runs with that data folder: DATA_DIR/owner.json.
/// NotFound: none runs there, or it asks for no tokens.
absl::StatusOr<KeptAccess> LoadOwner(const std::filesystem::path& data_dir);

/// saccade-server's own default: $XDG_DATA_HOME/saccade, else ~/.local/share/saccade.
std::filesystem::path DefaultDataDir();

/// Fills in TLS, root and token of `options.connection`: what the flags say; else what an earlier
/// --invite kept; else, of a server of this user, what owner.json says; else TLS with the system's
/// store, or plain on loopback. Redeems --invite, and keeps what came of it.
absl::Status ResolveAccess(Options& options);

}  // namespace saccade::cli
