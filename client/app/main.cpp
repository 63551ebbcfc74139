#include <pwd.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "client/app/app.hpp"
#include "client/app/options.hpp"
#include "client/app/settings.hpp"
#include "client/cli/interrupt.hpp"

namespace {

using namespace saccade;

int Fail(const absl::Status& problem) {
  std::fprintf(stderr, "saccade-client: %s\n", std::string(problem.message()).c_str());
  return 1;
}

/// As this machine calls its user.
std::string UserName() {
  const passwd* user = getpwuid(geteuid());
  return user == nullptr || user->pw_name == nullptr ? "expert" : user->pw_name;
}

int Run(const app::Options& options) {
  const std::filesystem::path file = app::SettingsFile();
  app::Settings settings;
  if (absl::Status loaded = app::LoadSettings(file, settings); !loaded.ok()) return Fail(loaded);
  if (!options.name.empty()) settings.name = options.name;
  if (settings.name.empty()) settings.name = UserName();
  if (absl::Status valid = settings.Validate(); !valid.ok()) return Fail(valid);
  auto made = app::App::Create(options, settings);
  if (!made.ok()) return Fail(made.status());
  const absl::Status status = (*made)->Run();
  const absl::Status kept = app::SaveSettings(file, (*made)->settings());
  if (!status.ok()) return Fail(status);
  return kept.ok() ? 0 : Fail(kept);
}

}  // namespace

int main(int argc, char** argv) {
  // gRPC's own words for what the window says; whoever wants them sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  app::ParseResult parsed = app::ParseCommandLine(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  cli::HearInterrupts();
  try {
    return Run(*parsed.options);
  } catch (const std::exception& error) {
    return Fail(absl::InternalError(error.what()));
  }
}
