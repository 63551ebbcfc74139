#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/identity/certificate.hpp"

namespace saccade {

/// With what a server shows who it is.
struct ServerIdentity {
  std::string chain_pem;  // the server's certificate, then those above it
  std::string key_pem;
  /// Whom clients have to trust; empty where the certificate was given: then they do already.
  std::string root_pem;
  std::string root_sha256;  // its fingerprint, "AB:CD:..."
  /// Of the names asked for those that the authority, which was made before, may not vouch for: by
  /// them nobody can connect.
  std::vector<std::string> not_named;
};

/// DIR/tls: authority.pem, authority.key, server.pem, server.key, for their owner alone (0600).
/// What is missing is made; a server's certificate is made anew in the last thirty days of its
/// life, or when `names` has one that it lacks. The authority stays as long as it is valid, so that
/// who trusts it need not do so again; it vouches for the names that it was made for, and for
/// private addresses. Says on stderr what it made. To be asked again and again while serving.
///   PermissionDenied, ResourceExhausted  a file cannot be written
///   DataLoss                             a file of the authority is damaged
absl::StatusOr<ServerIdentity> EnsureServerIdentity(const std::filesystem::path& directory,
                                                    const ServerNames& names,
                                                    std::int64_t now_unix_s);

/// What has to be said in the last weeks of what a server shows, in words with the remedy: of a
/// given certificate, that nobody can connect when it ends; of an authority of our own, that a new
/// one comes, which everybody has to trust anew. Empty: there is time.
std::string ExpiryWarning(const ServerIdentity& identity, std::int64_t now_unix_s);

/// From files that somebody else made (tls.certificate, tls.key). InvalidArgument names the file.
absl::StatusOr<ServerIdentity> LoadServerIdentity(const std::filesystem::path& certificate,
                                                  const std::filesystem::path& key,
                                                  std::int64_t now_unix_s);

}  // namespace saccade
