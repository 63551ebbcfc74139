#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace saccade::net {

/// The root of a server's own authority, from its page /trust, over plain HTTP: as nobody vouches
/// for it, its fingerprint has to be compared. `address`: HOST:PORT of the server's HTTP address,
/// or a link to it.
///   InvalidArgument  not of that form; Unavailable, DeadlineExceeded: no answer
///   NotFound         the server there has no authority of its own
absl::StatusOr<std::string> FetchRoot(const std::string& address);

/// The one certificate of a PEM text, and nothing else of it: what is trusted is what was compared.
/// InvalidArgument: there is none, or more than one.
absl::StatusOr<std::string> OneRoot(const std::string& pem);

/// SHA-256 of the first certificate of a PEM text, "AB:CD:..."; InvalidArgument: there is none.
absl::StatusOr<std::string> Fingerprint(const std::string& pem);

}  // namespace saccade::net
