#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/app/address.hpp"

namespace saccade::app {

/// The command line of saccade-client, parsed and checked.
struct Options {
  std::vector<Address> servers;  // a tab each; at least one
  std::string name;              // empty: as kept, or the user's own
  std::string trust;             // PEM file
  bool tls = false, plain = false;
  std::string trace;  // JSON lines about each picture shown; empty: none
};

/// Either options, or the code with which the program ends at once: help and version (0), bad usage
/// (2). Whatever there is to say is printed.
struct ParseResult {
  std::optional<Options> options;
  int exit_code = 0;
};
ParseResult ParseCommandLine(int argc, const char* const* argv);

}  // namespace saccade::app
