#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace saccade::app {

/// A server, and what lets one in there.
struct Address {
  std::string server = "127.0.0.1:50051";  // HOST:PORT of its gRPC address
  std::string invite;                      // link or token; empty: none
  bool plain = false;                      // a link that says http
};

/// An invite link as the server makes it (https://HOST:PORT/#invite=...), or one that the desktop
/// opens by itself: saccade://HOST[:GRPC_PORT][/][#invite=...]. A link names the port of the page,
/// not gRPC's: that is `grpc_port` then.
///   InvalidArgument  neither, with an example
absl::StatusOr<Address> ParseLink(const std::string& link, int grpc_port = 50051);

}  // namespace saccade::app
