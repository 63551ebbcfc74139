#include "client/app/options.hpp"

#include <absl/strings/numbers.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "client/net/connection.hpp"
#include "shared/version/version.hpp"

namespace saccade::app {
namespace {

int Usage(absl::string_view problem) {
  std::fprintf(stderr, "saccade-client: %.*s; see saccade-client --help\n",
               static_cast<int>(problem.size()), problem.data());
  return 2;
}

}  // namespace

ParseResult ParseCommandLine(int argc, const char* const* argv) {
  Options options;
  std::vector<std::string> servers, links;
  CLI::App app("The expert's desktop: live video, 3D map, marks that stay where they are put.",
               "saccade-client");
  app.set_version_flag("--version", std::string("saccade-client ") + Version());
  app.add_option("--server", servers,
                 "HOST:PORT of a server's gRPC address (127.0.0.1:50051); given again: another tab")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--name", options.name, "Your name, as the others see it; kept for the next time");
  CLI::Option* trust =
      app.add_option("--trust", options.trust,
                     "PEM file with the root that the server's certificate is trusted by");
  CLI::Option* tls = app.add_flag("--tls", options.tls, "Speak TLS, also to this machine");
  app.add_flag("--plain", options.plain, "Speak plain, without a token")
      ->excludes(trust)
      ->excludes(tls);
  app.add_option("--trace", options.trace,
                 "Write a JSON line about each picture shown to this file (for tests and reports)");
  app.add_option("link", links, "An invite link: https://... or saccade://...");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return {std::nullopt, app.exit(error)};
    return {std::nullopt, Usage(error.what())};
  }
  for (const std::string& server : servers) {
    net::ConnectionOptions connection;
    connection.server = server;
    if (absl::Status valid = connection.Validate(); !valid.ok()) {
      return {std::nullopt, Usage(valid.message())};
    }
    options.servers.push_back({server, "", false});
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    absl::StatusOr<Address> address = ParseLink(links[i]);
    if (!address.ok()) return {std::nullopt, Usage(address.status().message())};
    // One server and one link mean the same: the link does not say gRPC's port.
    if (servers.size() == 1 && links.size() == 1) {
      address->server = servers[0];
      options.servers.clear();
    }
    options.servers.push_back(*address);
  }
  if (options.servers.empty()) options.servers.emplace_back();
  return {std::move(options), 0};
}

}  // namespace saccade::app
