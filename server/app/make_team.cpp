#include "server/app/make_team.hpp"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <cstring>

#include "server/anchors/edit_checks.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kIdBytes = 36;

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

std::unique_ptr<TeamLink> LinkOf(const ServerConfig& config, TeamPort& team) {
  if (!config.team) return nullptr;
  return std::make_unique<TeamLink>(
      TeamLinkOptions{config.team->ToString(config.team->port), config.team_token}, team);
}

}  // namespace saccade
