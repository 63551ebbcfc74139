#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>

#include "client/cli/commands.hpp"
#include "client/cli/options.hpp"
#include "client/cli/session_file.hpp"
#include "client/net/connection.hpp"

namespace {

int Fail(absl::string_view problem) {
  std::cout.flush();
  // One line, whatever came over the wire.
  std::string line(problem.substr(0, 2000));
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  std::fprintf(stderr, "saccade: %s\n", line.c_str());
  return saccade::cli::kFailure;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace saccade;
  // gRPC's own words for what is said below in one line; whoever wants them sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  signal(SIGINT, SIG_DFL);  // a shell starts what is in the background deaf to it
  cli::ParseResult parsed = cli::ParseCommandLine(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  net::ConnectionOptions& options = parsed.options->connection;
  // Watching is a session of its own; editing goes on in the one of the last run.
  const bool keeps_session = parsed.options->command != cli::Command::kWatch;
  try {
    if (keeps_session) options.session_id = cli::LoadSession(options.server);
    const auto connection = net::Connection::Create(options);
    if (!connection.ok()) return Fail(connection.status().message());
    // Who holds the camera wants to be able to stop it from another terminal.
    if (parsed.options->command == cli::Command::kFixate) {
      const absl::StatusOr<std::string> joined = (*connection)->Session();
      if (joined.ok()) cli::SaveSession(options.server, *joined);
    }
    const absl::Status status = cli::Run(*parsed.options, **connection);
    const std::string& session = (*connection)->session_id();
    if (keeps_session && session != options.session_id) cli::SaveSession(options.server, session);
    if (!status.ok()) return Fail(status.message());
  } catch (const std::exception& error) {  // e.g. text that is not UTF-8 meets JSON
    return Fail(error.what());
  }
  std::cout.flush();
  if (!std::cout) return Fail("cannot write to standard output; is the disk full?");
  return cli::kSuccess;
}
