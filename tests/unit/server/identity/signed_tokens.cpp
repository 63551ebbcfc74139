#include "tests/unit/server/identity/signed_tokens.hpp"

#include <gtest/gtest.h>

namespace saccade::testing {

SigningKey::SigningKey(cjose_jwk_t* key, std::string algorithm, std::string id)
    : key_(key, Release()), algorithm_(std::move(algorithm)), id_(std::move(id)) {
  cjose_err error{};
  EXPECT_NE(key, nullptr);
  EXPECT_TRUE(cjose_jwk_set_kid(key, id_.data(), id_.size(), &error));
}

SigningKey SigningKey::Rsa(const std::string& id, int bits) {
  cjose_err error{};
  return {
      cjose_jwk_create_RSA_random(static_cast<std::size_t>(bits),
                                  reinterpret_cast<const std::uint8_t*>("\x01\x00\x01"), 3, &error),
      "RS256", id};
}

SigningKey SigningKey::P256(const std::string& id) {
  cjose_err error{};
  return {cjose_jwk_create_EC_random(CJOSE_JWK_EC_P_256, &error), "ES256", id};
}

SigningKey SigningKey::Hmac(const std::string& id, const std::string& secret) {
  cjose_err error{};
  return {cjose_jwk_create_oct_spec(reinterpret_cast<const std::uint8_t*>(secret.data()),
                                    secret.size(), &error),
          "HS256", id};
}

nlohmann::json SigningKey::Public() const {
  cjose_err error{};
  char* text = cjose_jwk_to_json(key_.get(), /*priv=*/false, &error);
  nlohmann::json key = nlohmann::json::parse(text);
  cjose_get_dealloc()(text);
  key["use"] = "sig";
  key["alg"] = algorithm_;
  return key;
}

std::string SigningKey::Sign(const nlohmann::json& claims, const nlohmann::json& header) const {
  cjose_err error{};
  cjose_header_t* protect = cjose_header_new(&error);
  const std::map<std::string, std::string> usual = {{"alg", algorithm_}, {"kid", id_}};
  for (const auto& [name, value] : usual) {
    if (!header.contains(name)) cjose_header_set(protect, name.c_str(), value.c_str(), &error);
  }
  for (const auto& [name, value] : header.items()) {
    if (value.is_null()) continue;  // left out
    if (value.is_string()) {
      cjose_header_set(protect, name.c_str(), value.get<std::string>().c_str(), &error);
    } else {
      cjose_header_set_raw(protect, name.c_str(), value.dump().c_str(), &error);
    }
  }
  const std::string text = claims.dump();
  cjose_jws_t* jws = cjose_jws_sign(
      key_.get(), protect, reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), &error);
  EXPECT_NE(jws, nullptr) << error.message;
  const char* compact = nullptr;
  cjose_jws_export(jws, &compact, &error);
  std::string token(compact);
  cjose_jws_release(jws);
  cjose_header_release(protect);
  return token;
}

std::string KeySetOf(const std::vector<const SigningKey*>& keys) {
  nlohmann::json all = nlohmann::json::array();
  for (const SigningKey* key : keys) all.push_back(key->Public());
  return nlohmann::json{{"keys", all}}.dump();
}

}  // namespace saccade::testing
