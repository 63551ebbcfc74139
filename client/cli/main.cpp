#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>

#include "client/cli/access_commands.hpp"
#include "client/cli/access_files.hpp"
#include "client/cli/cameras_command.hpp"
#include "client/cli/commands.hpp"
#include "client/cli/options.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/record_command.hpp"
#include "client/cli/scene_commands.hpp"
#include "client/cli/session_file.hpp"
#include "client/cli/talk_commands.hpp"
#include "client/cli/text.hpp"
#include "client/net/connection.hpp"

namespace {

using namespace saccade;

// One line on stderr, whatever came over the wire: stdout holds answers alone.
int Fail(const cli::Options& options, const absl::Status& problem) {
  std::cout.flush();
  const std::string text = cli::ProblemText(options, problem);
  const std::string line =
      options.json ? cli::Dump(cli::ProblemJson(problem.code(), text)) : "saccade: " + text;
  std::fprintf(stderr, "%s\n", line.c_str());
  return cli::kFailure;
}

absl::Status RunWithSession(cli::Options& options) {
  if (cli::IsAccessCommand(options.command)) return cli::RunAccess(options);
  if (absl::Status resolved = cli::ResolveAccess(options); !resolved.ok()) return resolved;
  if (cli::IsSceneCommand(options.command)) return cli::RunScene(options);
  if (cli::IsTalkCommand(options.command)) return cli::RunTalk(options);
  net::ConnectionOptions& to = options.connection;
  // Watching is a session of its own; editing goes on in the one of the last run.
  const bool keeps_session = options.command != cli::Command::kWatch;
  to.person_key = cli::PersonKey(to.server, to.display_name);
  if (keeps_session) to.session_id = cli::LoadSession(to.server, to.display_name);
  const auto connection = net::Connection::Create(to);
  if (!connection.ok()) return connection.status();
  // Who holds the camera wants to be able to stop it from another terminal.
  if (options.command == cli::Command::kFixate) {
    const absl::StatusOr<std::string> joined = (*connection)->Session();
    if (joined.ok()) cli::SaveSession(to.server, to.display_name, *joined);
  }
  const absl::Status status = cli::Run(options, **connection);
  const std::string& session = (*connection)->session_id();
  if (keeps_session && session != to.session_id) {
    cli::SaveSession(to.server, to.display_name, session);
  }
  return status;
}

absl::Status RunCommand(cli::Options& options) {
  if (options.command == cli::Command::kCameras) return cli::RunCameras(options);
  if (options.command == cli::Command::kRecord) return cli::RunRecord(options);
  if (options.command == cli::Command::kCalibrateCamera) return cli::RunCalibrateCamera(options);
  if (options.command == cli::Command::kPrintMarkers) return cli::RunPrintMarkers(options);
  if (options.command == cli::Command::kReplay) return cli::RunReplay(options);
  return RunWithSession(options);
}

}  // namespace

int main(int argc, char** argv) {
  // gRPC's own words for what is said below in one line; whoever wants them sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  signal(SIGINT, SIG_DFL);  // a shell starts what is in the background deaf to it
  cli::ParseResult parsed = cli::ParseCommandLine(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  cli::Options& options = *parsed.options;
  try {
    const absl::Status status = RunCommand(options);
    if (!status.ok()) return Fail(options, status);
  } catch (const std::exception& error) {
    return Fail(options, absl::InternalError(error.what()));
  }
  std::cout.flush();
  if (!std::cout) {
    return Fail(options,
                absl::UnavailableError("cannot write to standard output; is the disk full?"));
  }
  return cli::kSuccess;
}
