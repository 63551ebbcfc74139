#include "server/identity/sign_in_table.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "server/identity/secret.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostBegun = 1000, kMaxUriBytes = 300;
constexpr Timestamp kLife_ns = 600'000'000'000;
constexpr std::size_t kChallengeCharacters = 43, kLeastVerifier = 43, kMostVerifier = 128;

bool IsUnreserved(char c) {
  return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
         absl::StrContains("-._~", std::string(1, c));
}

}  // namespace

absl::Status CheckSignInRequest(const std::string& redirect_uri,
                                const std::string& code_challenge) {
  absl::string_view host = redirect_uri;
  const bool web = absl::ConsumePrefix(&host, "https://") || absl::ConsumePrefix(&host, "http://");
  // The provider knows which ones it may send people to; this is for plain words.
  if (!web || redirect_uri.size() > kMaxUriBytes || host.find('/') != host.size() - 1 ||
      host.size() < 2 || absl::StrContains(host, '@') || absl::StrContains(host, '#')) {
    return absl::InvalidArgumentError("redirect_uri: is not like https://HOST[:PORT]/");
  }
  if (code_challenge.size() != kChallengeCharacters ||
      !std::all_of(code_challenge.begin(), code_challenge.end(), IsUnreserved)) {
    return absl::InvalidArgumentError(
        "code_challenge: give the SHA-256 of the verifier as base64url, 43 characters");
  }
  return absl::OkStatus();
}

SignInTable::Begun SignInTable::Begin(const std::string& redirect_uri, const std::string& challenge,
                                      Timestamp now_ns) {
  absl::erase_if(
      begun_, [now_ns](const auto& entry) { return now_ns - entry.second.begun_ns >= kLife_ns; });
  if (begun_.size() >= kMostBegun) {
    begun_.erase(std::min_element(begun_.begin(), begun_.end(), [](const auto& a, const auto& b) {
      return a.second.begun_ns < b.second.begun_ns;
    }));
  }
  Begun begun{NewToken('x').secret, NewToken('x').secret, redirect_uri, challenge, now_ns};
  return begun_[begun.state] = begun;
}

absl::StatusOr<SignInTable::Begun> SignInTable::Take(const std::string& state,
                                                     const std::string& verifier,
                                                     Timestamp now_ns) {
  const auto found = begun_.find(state);
  if (found == begun_.end() || now_ns - found->second.begun_ns >= kLife_ns) {
    return absl::UnauthenticatedError(
        "access: this sign-in was not begun here, or is over (ten minutes, once); sign in again");
  }
  Begun begun = found->second;
  begun_.erase(found);
  const bool fits = verifier.size() >= kLeastVerifier && verifier.size() <= kMostVerifier &&
                    SameSecret(Sha256Base64Url(verifier), begun.challenge);
  if (!fits) {
    return absl::UnauthenticatedError(
        "access: code_verifier: this sign-in was begun by another browser; sign in again");
  }
  return begun;
}

}  // namespace saccade
