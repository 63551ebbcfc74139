#pragma once

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

namespace saccade {

/// What somebody shows to be let in: "ID.SECRET". The id is looked up, the secret is compared.
struct Token {
  std::string id;      // begins with its kind's letter: 'i'nvite, 'p'ass, 'o'wner
  std::string secret;  // 256 random bits as base64url, 43 characters

  std::string ToString() const { return id + "." + secret; }
};

/// From the system's entropy. Never fails: a system without entropy ends the process.
Token NewToken(char kind);

/// Nothing: not of that form.
std::optional<Token> ParseToken(absl::string_view text);

/// SHA-256 as 64 lower-case hexadecimal digits: what is kept of a secret. Secrets have 256 bits of
/// entropy, so no salt and no slow hash are needed.
std::string Sha256Hex(absl::string_view data);

/// SHA-256 as base64url without padding, 43 characters (PKCE's S256).
std::string Sha256Base64Url(absl::string_view data);

/// In a time that tells only whether the lengths differ.
bool SameSecret(absl::string_view a, absl::string_view b);

}  // namespace saccade
