#pragma once

#include <cjose/cjose.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace saccade::testing {

/// A key of an issuer's, and what it signs.
class SigningKey {
 public:
  /// RS256 with so many bits, or ES256.
  static SigningKey Rsa(const std::string& id, int bits = 2048);
  static SigningKey P256(const std::string& id);
  /// HS256 with these bytes as its secret.
  static SigningKey Hmac(const std::string& id, const std::string& secret);

  const std::string& algorithm() const { return algorithm_; }
  /// As it stands in a JWKS, with "use", "kid", "alg".
  nlohmann::json Public() const;
  /// A compact JWS; `header` goes over "alg" and "kid".
  std::string Sign(const nlohmann::json& claims, const nlohmann::json& header = {}) const;

 private:
  struct Release {
    void operator()(cjose_jwk_t* key) const { cjose_jwk_release(key); }
  };
  SigningKey(cjose_jwk_t* key, std::string algorithm, std::string id);
  std::shared_ptr<cjose_jwk_t> key_;
  std::string algorithm_, id_;
};

/// {"keys": [...]} as text.
std::string KeySetOf(const std::vector<const SigningKey*>& keys);

}  // namespace saccade::testing
