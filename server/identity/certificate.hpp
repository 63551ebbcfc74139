#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

namespace saccade {

/// A certificate with its key, both as PEM.
struct CertificateAndKey {
  std::string certificate_pem;
  std::string key_pem;
};

/// By which names a server is called.
struct ServerNames {
  std::vector<std::string> dns;        // "localhost", the host's name
  std::vector<std::string> addresses;  // IP literals, without zone

  /// "localhost", this machine's name, and the addresses of every interface that is up.
  static ServerNames OfThisMachine();
  /// One more: a host name or an IP literal (brackets allowed), unless it is there already.
  void Add(std::string host);
  /// All of them, for people.
  std::vector<std::string> All() const;
};

/// An authority of one's own: ECDSA P-256, self-signed, ten years, for servers only, and only for
/// those called by `names` (name constraints, critical): its DNS names, also with ".local" behind
/// them; its public addresses, of IPv6 the whole /64, as hosts change theirs daily; and any private
/// address, so that the next network needs no new authority. Without names: for any name.
absl::StatusOr<CertificateAndKey> MakeAuthority(const std::string& common_name,
                                                const ServerNames& names = {});

/// Of `names` those that this authority may vouch for.
ServerNames PermittedBy(const std::string& authority_pem, const ServerNames& names);

/// A server's certificate from it: ECDSA P-256, 397 days (what browsers accept at most).
absl::StatusOr<CertificateAndKey> MakeServerCertificate(const CertificateAndKey& authority,
                                                        const ServerNames& names);

/// What matters of the first certificate of a PEM text.
struct CertificateFacts {
  std::int64_t not_before_unix_s = 0, not_after_unix_s = 0;
  ServerNames names;
  std::string sha256;  // fingerprint, "AB:CD:..."
};
/// InvalidArgument: no certificate.
absl::StatusOr<CertificateFacts> InspectCertificate(const std::string& pem);

/// InvalidArgument: either cannot be read, or they are not of the same pair.
absl::Status CheckPair(const std::string& certificate_pem, const std::string& key_pem);
/// Whether `certificate_pem` was signed by the authority.
bool SignedBy(const std::string& certificate_pem, const std::string& authority_pem);

}  // namespace saccade
