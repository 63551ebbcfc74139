#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

#include "client/cli/commands.hpp"
#include "client/cli/options.hpp"
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
  cli::ParseResult parsed = cli::ParseCommandLine(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  try {
    const auto connection = net::Connection::Create(parsed.options->connection);
    if (!connection.ok()) return Fail(connection.status().message());
    const absl::Status status = cli::Run(*parsed.options, **connection);
    if (!status.ok()) return Fail(status.message());
  } catch (const std::exception& error) {  // e.g. text that is not UTF-8 meets JSON
    return Fail(error.what());
  }
  std::cout.flush();
  if (!std::cout) return Fail("cannot write to standard output; is the disk full?");
  return cli::kSuccess;
}
