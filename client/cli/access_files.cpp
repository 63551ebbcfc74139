#include "client/cli/access_files.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "client/cli/session_file.hpp"
#include "client/net/access_client.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxFileBytes = 256 * 1024;

/// Nothing where it is not there, not this user's alone, or makes no sense.
std::optional<KeptAccess> Load(const fs::path& file) {
  struct stat facts {};
  if (::stat(file.c_str(), &facts) != 0 || (facts.st_mode & 077) != 0 ||
      facts.st_uid != ::geteuid()) {
    return std::nullopt;
  }
  const absl::StatusOr<std::string> text = ReadRegularFile(file, kMaxFileBytes, "an access file");
  if (!text.ok()) return std::nullopt;
  const nlohmann::json json = nlohmann::json::parse(*text, nullptr, /*allow_exceptions=*/false);
  const auto word = [&json](const char* key) {
    return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
  };
  if (!json.is_object() || word("grpc").empty()) return std::nullopt;
  const bool tls = json.contains("tls") && json["tls"].is_boolean() && json["tls"].get<bool>();
  return KeptAccess{word("grpc"), tls, word("root"), word("token"), word("name")};
}

/// Beside the sessions: one a server. Empty: nowhere.
std::string AccessFilePath(const std::string& server) {
  return SessionFilePath(server, "access of this user");
}

absl::Status Keep(const KeptAccess& access) {
  const std::string path = AccessFilePath(access.server);
  if (path.empty()) return absl::OkStatus();
  std::error_code ignored;
  fs::create_directories(fs::path(path).parent_path(), ignored);
  fs::permissions(fs::path(path).parent_path(), fs::perms::owner_all, ignored);
  const nlohmann::json json = {{"grpc", access.server},
                               {"tls", access.tls},
                               {"root", access.root_pem},
                               {"token", access.token}};
  if (WritePrivateFile(path, json.dump() + "\n") == 0) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot keep the pass in ", path,
                                             ": make that folder writable; the invite is used up"));
}

bool IsLoopback(const std::string& server) {
  return absl::StartsWith(server, "127.") || absl::StartsWith(server, "[::1]:") ||
         absl::StartsWith(server, "localhost:");
}

// Not on the command line, which every account of the machine sees.
absl::StatusOr<std::string> ReadIdToken(const std::string& file) {
  std::string text;
  if (file == "-") {
    text.resize(kMaxFileBytes);
    std::cin.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(std::cin.gcount()));
  } else {
    absl::StatusOr<std::string> read = ReadRegularFile(file, kMaxFileBytes, "an ID token");
    if (!read.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("--id-token: ", read.status().message()));
    }
    text = *std::move(read);
  }
  const absl::string_view token = absl::StripAsciiWhitespace(text);
  if (token.empty()) return absl::InvalidArgumentError("--id-token: there is no token in it");
  return std::string(token);
}

void Apply(KeptAccess kept, net::ConnectionOptions& to) {
  to.tls = kept.tls;
  to.root_pem = std::move(kept.root_pem);
  to.token = std::move(kept.token);
  to.tls_name = std::move(kept.name);
}

}  // namespace

fs::path DefaultDataDir() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data != 0) {
    return fs::path(data) / "saccade";
  }
  const char* home = std::getenv("HOME");
  return home == nullptr || *home == 0 ? fs::path() : fs::path(home) / ".local/share/saccade";
}

absl::StatusOr<KeptAccess> LoadOwner(const fs::path& data_dir) {
  if (data_dir.empty()) {
    return absl::NotFoundError("no data folder: HOME is not set; give --data-dir");
  }
  const fs::path file = data_dir / "owner.json";
  if (std::optional<KeptAccess> owner = Load(file)) return *std::move(owner);
  return absl::NotFoundError(
      absl::StrCat("no ", file.string(),
                   " of yours: no saccade-server that asks for invites runs "
                   "with that folder; name its --data-dir, as the user it runs as"));
}

absl::Status ResolveAccess(Options& options) {
  net::ConnectionOptions& to = options.connection;
  const fs::path data_dir =
      options.data_dir.empty() ? DefaultDataDir() : fs::path(options.data_dir);
  if (std::optional<KeptAccess> kept = Load(AccessFilePath(to.server))) {
    Apply(*std::move(kept), to);
  } else if (absl::StatusOr<KeptAccess> owner = LoadOwner(data_dir);
             owner.ok() && owner->server == to.server) {
    Apply(*std::move(owner), to);
  } else {
    to.tls = !IsLoopback(to.server);
  }
  if (options.plain) {  // and no secret with it
    to.tls = false;
    to.token.clear();
  }
  if (options.tls) to.tls = true;
  if (!options.trust.empty()) {
    absl::StatusOr<std::string> root =
        ReadRegularFile(options.trust, kMaxFileBytes, "a certificate");
    if (!root.ok())
      return absl::InvalidArgumentError(absl::StrCat("--trust: ", root.status().message()));
    to.tls = true;
    to.root_pem = *std::move(root);
  }
  if (options.invite.empty() && options.id_token_file.empty()) return absl::OkStatus();
  to.token.clear();
  absl::StatusOr<net::Pass> pass = absl::InternalError("");
  if (options.id_token_file.empty()) {
    pass = net::AccessClient(to).Redeem(options.invite, to.display_name);
  } else {
    const absl::StatusOr<std::string> token = ReadIdToken(options.id_token_file);
    if (!token.ok()) return token.status();
    pass = net::AccessClient(to).RedeemIdToken(*token);
  }
  if (!pass.ok()) return pass.status();
  to.token = pass->token;
  return Keep({to.server, to.tls, to.root_pem, to.token, ""});
}

}  // namespace saccade::cli
