#include "server/identity/secret.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <cstdlib>

namespace saccade {
namespace {

constexpr std::size_t kIdBytes = 6, kSecretBytes = 32;
constexpr std::size_t kIdCharacters = 1 + 2 * kIdBytes, kSecretCharacters = 43;

template <std::size_t kSize>
std::string RandomBytes() {
  std::array<unsigned char, kSize> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) std::abort();
  return {bytes.begin(), bytes.end()};
}

std::string Sha256(absl::string_view data) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  SHA256(reinterpret_cast<const unsigned char*>(data.data()), data.size(), hash.data());
  return {reinterpret_cast<const char*>(hash.data()), hash.size()};
}

bool IsBase64Url(char c) {
  return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
}

}  // namespace

Token NewToken(char kind) {
  std::string secret = absl::WebSafeBase64Escape(RandomBytes<kSecretBytes>());
  return {absl::StrCat(std::string(1, kind), absl::BytesToHexString(RandomBytes<kIdBytes>())),
          std::move(secret)};
}

std::optional<Token> ParseToken(absl::string_view text) {
  const std::size_t dot = text.find('.');
  if (dot != kIdCharacters || text.size() != dot + 1 + kSecretCharacters) return std::nullopt;
  const absl::string_view id = text.substr(0, dot), secret = text.substr(dot + 1);
  const auto alphanumeric = [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c));
  };
  if (!std::all_of(id.begin(), id.end(), alphanumeric)) return std::nullopt;
  if (!std::all_of(secret.begin(), secret.end(), IsBase64Url)) return std::nullopt;
  return Token{std::string(id), std::string(secret)};
}

std::string Sha256Hex(absl::string_view data) { return absl::BytesToHexString(Sha256(data)); }

std::string Sha256Base64Url(absl::string_view data) {
  return absl::WebSafeBase64Escape(Sha256(data));
}

bool SameSecret(absl::string_view a, absl::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace saccade
