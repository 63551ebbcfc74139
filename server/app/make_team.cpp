#include "server/app/make_team.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <unistd.h>

#include <cstring>

#include "server/anchors/edit_checks.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kIdBytes = 36;
constexpr std::size_t kTokenBytes = 4096, kRootBytes = 65536;

/// The same over restarts, so that others know their marks again.
std::string DeviceId(const std::filesystem::path& data_dir) {
  const std::filesystem::path file = data_dir / "team_device_id";
  const absl::StatusOr<std::string> kept = ReadRegularFile(file, kIdBytes, "a device's id");
  if (kept.ok() && kept->size() == kIdBytes) return *kept;
  const std::string id = MakeUuid();
  if (const int error = WritePrivateFile(file, id); error != 0) {
    Log(absl::StrCat(file.string(), ": ", std::strerror(error),
                     "; after a restart others take this server for another one"));
  }
  return id;
}

std::string NameOfMachine() {
  char name[60] = {};
  return gethostname(name, sizeof(name) - 1) == 0 ? name : "";
}

/// What a kept token was for: another server or a new invite makes it void.
std::string Whose(const TeamLinkOptions& options) {
  return absl::StrCat(options.address, " ", options.invite.substr(0, options.invite.find('.')));
}

/// Empty: none is kept, or it was for something else.
std::string KeptToken(const std::filesystem::path& file, const TeamLinkOptions& options) {
  const absl::StatusOr<std::string> kept = ReadRegularFile(file, kTokenBytes, "a token");
  if (!kept.ok()) return "";
  const std::pair<std::string, std::string> parts = absl::StrSplit(*kept, absl::MaxSplits('\n', 1));
  return parts.first == Whose(options) ? parts.second : "";
}

}  // namespace

std::unique_ptr<TeamRunner> MakeTeam(const ServerConfig& config, Engine& engine) {
  TeamRunnerOptions options;
  options.device_id = DeviceId(config.data_dir);
  options.display_name = config.team_name.empty() ? NameOfMachine() : config.team_name;
  options.from_the_start = config.team.has_value();
  auto runner = std::make_unique<TeamRunner>(std::move(options), engine);
  engine.SetFrameListener(
      [team = runner.get()](const std::shared_ptr<const Frame>& frame,
                            const TrackedEvent& tracked) { team->OnFrame(frame, tracked); });
  return runner;
}

absl::StatusOr<std::optional<TeamLinkOptions>> LinkOf(const ServerConfig& config) {
  if (!config.team) return std::nullopt;
  TeamLinkOptions options;
  options.address = config.team->ToString(config.team->port);
  options.invite = config.team_invite;
  options.name = config.team_name.empty() ? NameOfMachine() : config.team_name;
  const std::filesystem::path kept = config.data_dir / "team_token";
  options.token = config.team_token.empty() ? KeptToken(kept, options) : config.team_token;
  options.keep_token = [kept, whose = Whose(options)](const std::string& token) {
    if (const int error = WritePrivateFile(kept, absl::StrCat(whose, "\n", token)); error != 0) {
      Log(absl::StrCat(kept.string(), ": ", std::strerror(error),
                       "; the next start needs another --team-invite"));
    }
  };
  if (!config.team_trust.empty()) {
    absl::StatusOr<std::string> root =
        ReadRegularFile(config.team_trust, kRootBytes, "--team-trust");
    if (!root.ok()) return root.status();
    if (!absl::StrContains(*root, "BEGIN CERTIFICATE")) {  // without a root the way would be plain
      return absl::InvalidArgumentError(absl::StrCat("--team-trust ", config.team_trust.string(),
                                                     ": no PEM certificate is in it"));
    }
    options.root_pem = *std::move(root);
  }
  return options;
}

}  // namespace saccade
