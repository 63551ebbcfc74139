#include "server/identity/id_token.hpp"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <cjose/cjose.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace saccade {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxTokenBytes = 16 * 1024;
constexpr std::size_t kMaxKeys = 64, kMaxKeyIdBytes = 256;
constexpr std::size_t kLeastModulusBytes = 256, kMostModulusBytes = 1024;

struct JwkDeleter {
  void operator()(cjose_jwk_t* key) const { cjose_jwk_release(key); }
};
struct JwsDeleter {
  void operator()(cjose_jws_t* jws) const { cjose_jws_release(jws); }
};

absl::Status No(absl::string_view why) {
  return absl::UnauthenticatedError(absl::StrCat("id_token: ", why));
}

/// Empty: not there, or no text.
std::string Text(const json& object, const char* name) {
  const auto at = object.find(name);
  return at != object.end() && at->is_string() ? at->get<std::string>() : "";
}

std::size_t ModulusBytes(const json& key) {
  std::string bytes;
  if (!absl::WebSafeBase64Unescape(Text(key, "n"), &bytes)) return 0;
  return bytes.size() - std::min(bytes.size(), bytes.find_first_not_of('\0'));
}

/// Which algorithm this key is for; empty: none of ours.
std::string AlgorithmOf(const json& key) {
  if (!key.is_object() || key.contains("d")) return "";  // whose secret is told
  const std::string kind = Text(key, "kty"), use = Text(key, "use"), told = Text(key, "alg");
  if (!use.empty() && use != "sig") return "";
  std::string algorithm;
  if (kind == "EC" && Text(key, "crv") == "P-256") algorithm = "ES256";
  const std::size_t modulus = kind == "RSA" ? ModulusBytes(key) : 0;
  if (modulus >= kLeastModulusBytes && modulus <= kMostModulusBytes) algorithm = "RS256";
  return told.empty() || told == algorithm ? algorithm : "";
}

}  // namespace

struct IssuerKeys::Key {
  std::string id, algorithm;
  std::unique_ptr<cjose_jwk_t, JwkDeleter> key;
};

IssuerKeys::IssuerKeys() = default;
IssuerKeys::~IssuerKeys() = default;

absl::StatusOr<std::shared_ptr<const IssuerKeys>> IssuerKeys::Parse(absl::string_view text) {
  const json set = json::parse(text, nullptr, /*allow_exceptions=*/false);
  const auto keys = set.is_object() ? set.find("keys") : set.end();
  if (!set.is_object() || keys == set.end() || !keys->is_array()) {
    return absl::InvalidArgumentError("is no key set (JWKS)");
  }
  std::shared_ptr<IssuerKeys> all(new IssuerKeys());
  for (const json& one : *keys) {
    const std::string algorithm = AlgorithmOf(one), id = algorithm.empty() ? "" : Text(one, "kid");
    if (algorithm.empty() || id.size() > kMaxKeyIdBytes || all->keys_.size() >= kMaxKeys) continue;
    const std::string told = one.dump();
    cjose_err ignored{};
    auto key = std::make_unique<Key>();
    key->key.reset(cjose_jwk_import(told.data(), told.size(), &ignored));
    if (key->key == nullptr) continue;
    key->id = id;
    key->algorithm = algorithm;
    all->keys_.push_back(std::move(key));
  }
  if (all->keys_.empty()) {
    return absl::InvalidArgumentError("has no key for RS256 (from 2048 bits) or ES256");
  }
  return all;
}

absl::StatusOr<std::string> VerifiedPayload(absl::string_view token, const IssuerKeys& keys) {
  if (token.size() > kMaxTokenBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("id_token: ", token.size(), " bytes; at most ", kMaxTokenBytes));
  }
  cjose_err error{};
  const std::unique_ptr<cjose_jws_t, JwsDeleter> jws(
      cjose_jws_import(token.data(), token.size(), &error));
  if (jws == nullptr) {
    return absl::InvalidArgumentError(
        "id_token: is no signed token (JWT in its compact form: three parts with dots between)");
  }
  cjose_header_t* header = cjose_jws_get_protected(jws.get());
  const auto field = [&](const char* name) {
    const char* value = cjose_header_get(header, name, &error);
    return std::string(value == nullptr ? "" : value);
  };
  const std::string algorithm = field(CJOSE_HDR_ALG);
  // Before any key is looked at: which kind of check is done is not the token's to say.
  if (algorithm != "RS256" && algorithm != "ES256") {
    return No("is not signed as it has to be: RS256 or ES256");
  }
  char* critical = cjose_header_get_raw(header, "crit", &error);
  if (critical != nullptr) {
    cjose_get_dealloc()(critical);
    return No("asks for extensions (crit) that are not known here");
  }
  if (const std::string type = field("typ"); !type.empty() && type != "JWT") {
    return No("is a token of another kind (typ)");
  }
  const std::string id = field(CJOSE_HDR_KID);
  const IssuerKeys::Key* chosen = nullptr;
  for (const auto& key : keys.keys_) {
    if (key->algorithm != algorithm || (!id.empty() && key->id != id)) continue;
    if (chosen != nullptr) return No("names no key (kid), and the issuer has several");
    chosen = key.get();
  }
  if (chosen == nullptr) return absl::NotFoundError("id_token: is signed by a key of nobody known");
  if (!cjose_jws_verify(jws.get(), chosen->key.get(), &error)) {
    return No("its signature is not the issuer's");
  }
  std::uint8_t* bytes = nullptr;
  std::size_t size = 0;
  if (!cjose_jws_get_plaintext(jws.get(), &bytes, &size, &error)) return No("has no content");
  return std::string(reinterpret_cast<const char*>(bytes), size);
}

}  // namespace saccade
