#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/identity/id_token.hpp"

namespace saccade {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNameBytes = 60, kMaxSubjectBytes = 255, kMaxRoles = 1000;
constexpr double kMostTime_s = 1e11;

absl::Status No(absl::string_view claim, absl::string_view why) {
  return absl::UnauthenticatedError(absl::StrCat("id_token: ", claim, ": ", why));
}

std::optional<std::string> TextClaim(const json& claims, const char* name) {
  const auto at = claims.find(name);
  if (at == claims.end() || !at->is_string()) return std::nullopt;
  return at->get<std::string>();
}

/// Nothing: not there, or no time.
std::optional<std::int64_t> Time(const json& claims, const char* name) {
  const auto at = claims.find(name);
  if (at == claims.end() || !at->is_number()) return std::nullopt;
  const double value = at->get<double>();
  if (!(value >= 0 && value <= kMostTime_s)) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

std::vector<std::string> Texts(const json& value, std::size_t most) {
  std::vector<std::string> all;
  if (value.is_string()) all.push_back(value.get<std::string>());
  if (!value.is_array()) return all;
  for (const json& one : value) {
    if (one.is_string() && all.size() < most) all.push_back(one.get<std::string>());
  }
  return all;
}

absl::Status CheckAudience(const json& claims, const IdTokenRules& rules) {
  const auto known = [&rules](const std::string& one) {
    return std::find(rules.audiences.begin(), rules.audiences.end(), one) != rules.audiences.end();
  };
  const auto at = claims.find("aud");
  const bool listed = at != claims.end() && (at->is_string() || at->is_array());
  const std::vector<std::string> all = listed ? Texts(*at, kMaxRoles) : std::vector<std::string>();
  // Also where something in the list is no text.
  const bool whole = listed && (at->is_string() || at->size() == all.size());
  if (!whole || all.empty() || !std::all_of(all.begin(), all.end(), known)) {
    return No("aud", "is for somebody else");
  }
  if (claims.contains("azp") && !known(TextClaim(claims, "azp").value_or(""))) {
    return No("azp", "was given to somebody else");
  }
  return absl::OkStatus();
}

absl::Status CheckTimes(const json& claims, std::int64_t now_unix_s, std::int64_t& expires_unix_s) {
  const std::optional<std::int64_t> expires = Time(claims, "exp"), issued = Time(claims, "iat");
  if (!expires) return No("exp", "is missing, or no time");
  if (!issued) return No("iat", "is missing, or no time");
  if (now_unix_s >= *expires + kClockSkew_s) return No("exp", "has expired; sign in again");
  const char* early = "is in the future; compare this machine's clock with the issuer's";
  if (*issued > now_unix_s + kClockSkew_s) return No("iat", early);
  if (claims.contains("nbf")) {
    const std::optional<std::int64_t> from = Time(claims, "nbf");
    if (!from) return No("nbf", "is no time");
    if (*from > now_unix_s + kClockSkew_s) return No("nbf", early);
  }
  if (*expires > now_unix_s + kMostTokenLife_s) {
    return No("exp", "is more than seven days away; have the issuer give shorter ones");
  }
  expires_unix_s = *expires;
  return absl::OkStatus();
}

/// At most so many bytes, and no half character at the end.
std::string Cut(std::string text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0) == 0x80) --most;
  return text.substr(0, most);
}

std::string NameOf(const json& claims, const std::string& subject) {
  for (const char* claim : {"name", "preferred_username", "email"}) {
    const std::string text(absl::StripAsciiWhitespace(TextClaim(claims, claim).value_or("")));
    if (!text.empty()) return Cut(text, kMaxNameBytes);
  }
  return Cut(subject, kMaxNameBytes);
}

std::vector<std::string> RolesOf(const json& claims, const std::string& claim) {
  if (claim.empty()) return {};
  if (const auto at = claims.find(claim); at != claims.end()) return Texts(*at, kMaxRoles);
  const json* at = &claims;
  for (const absl::string_view part : absl::StrSplit(claim, '.')) {
    if (!at->is_object() || !at->contains(std::string(part))) return {};
    at = &(*at)[std::string(part)];
  }
  return Texts(*at, kMaxRoles);
}

}  // namespace

absl::StatusOr<IdTokenClaims> CheckClaims(absl::string_view payload, const IdTokenRules& rules,
                                          std::int64_t now_unix_s) {
  const json claims = json::parse(payload, nullptr, /*allow_exceptions=*/false);
  if (!claims.is_object()) return No("payload", "is no JSON object");
  if (TextClaim(claims, "iss") != rules.issuer) return No("iss", "is by another issuer");
  if (absl::Status audience = CheckAudience(claims, rules); !audience.ok()) return audience;
  IdTokenClaims told;
  absl::Status times = CheckTimes(claims, now_unix_s, told.expires_unix_s);
  if (!times.ok()) return times;
  if (!rules.nonce.empty() && TextClaim(claims, "nonce") != rules.nonce) {
    return No("nonce", "is of another sign-in");
  }
  told.subject = TextClaim(claims, "sub").value_or("");
  if (told.subject.empty() || told.subject.size() > kMaxSubjectBytes) {
    return No("sub", "says nobody");
  }
  told.name = NameOf(claims, told.subject);
  told.roles = RolesOf(claims, rules.role_claim);
  return told;
}

}  // namespace saccade
