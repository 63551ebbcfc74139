#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

namespace saccade {

/// [limits] of the server's file: what callers may ask for. Rates are long-term; some seconds'
/// worth of each may come at once. 0: no limit, unless the table says otherwise.
struct LimitSettings {
  double scale = 1;  // of every rate, also of server/rpc/admission.hpp; 0: no rates, no counts

  // Of a pass (one person with an invite).
  double requests_per_s = 500;
  double bytes_per_s = 8e6;
  int sessions = 32;
  // Of everybody who came by one invite.
  double invite_requests_per_s = 2000;
  double invite_bytes_per_s = 32e6;
  int invite_sessions = 128;
  // Of an address, where its callers have no pass or use much of theirs.
  double address_requests_per_s = 2000;
  double address_bytes_per_s = 32e6;
  double address_connections_per_s = 50;
  int address_connections = 256;
  int address_unheard = 64;
  int network_connections = 512;
  bool this_machine = false;
  // Of everybody together.
  int connections = 1024;
  int annotations = 1000;
  int session_annotations = 750;

  absl::Status Validate() const;
  /// A file without [limits] changes nothing. Errors as LoadTomlTable.
  absl::Status LoadToml(const std::filesystem::path& file);
  static std::string Describe();
};

}  // namespace saccade
