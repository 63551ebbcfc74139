#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace saccade {

/// The keys that an issuer signs with (JWKS). Immutable.
class IssuerKeys {
 public:
  /// Keys of other kinds and uses are left out: RSA from 2048 to 8192 bits (RS256) and P-256
  /// (ES256) remain. InvalidArgument: no key set, or none of these in it.
  static absl::StatusOr<std::shared_ptr<const IssuerKeys>> Parse(absl::string_view json);
  ~IssuerKeys();

 private:
  friend absl::StatusOr<std::string> VerifiedPayload(absl::string_view, const IssuerKeys&);
  struct Key;
  IssuerKeys();
  std::vector<std::unique_ptr<Key>> keys_;
};

/// The payload of a signed token (JWS, compact), once its signature was checked.
///   InvalidArgument  no such token, or longer than 16 KiB
///   Unauthenticated  another algorithm than RS256 and ES256 ("none", HMAC), or not signed by a key
///   NotFound         signed by a key that is not among these: fetch them anew
absl::StatusOr<std::string> VerifiedPayload(absl::string_view token, const IssuerKeys& keys);

/// What an ID token has to say.
struct IdTokenRules {
  std::string issuer;
  std::vector<std::string> audiences;  // each of the token's has to be one of these
  std::string role_claim;              // "groups"; "realm_access.roles": one in another
  std::string nonce;                   // empty: none is asked for
};

/// What it says.
struct IdTokenClaims {
  std::string subject;
  std::string name;                // for people: name, preferred_username, email or subject
  std::vector<std::string> roles;  // the values of the role claim
  std::int64_t expires_unix_s = 0;
};

/// Clocks may differ by so much, either way.
inline constexpr std::int64_t kClockSkew_s = 60;
/// A token that holds longer is refused: nobody could end it.
inline constexpr std::int64_t kMostTokenLife_s = 7 * 86'400;

/// Unauthenticated names the claim: iss, aud, azp, exp, nbf, iat, nonce, sub.
absl::StatusOr<IdTokenClaims> CheckClaims(absl::string_view payload, const IdTokenRules& rules,
                                          std::int64_t now_unix_s);

}  // namespace saccade
