#include "server/identity/issuer_documents.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <nlohmann/json.hpp>

namespace saccade {
namespace {

constexpr Timestamp kKeep_ns = 3600'000'000'000, kAgain_ns = 5'000'000'000;
constexpr Timestamp kAfterFailure_ns = 5'000'000'000;
constexpr std::size_t kMaxUrlBytes = 2000;

bool IsOnThisMachine(absl::string_view url) {
  if (!absl::ConsumePrefix(&url, "http://")) return false;
  const absl::string_view host = url.substr(0, url.find('/'));
  for (const absl::string_view own : {"127.0.0.1", "localhost", "[::1]"}) {
    if (host == own || absl::StartsWith(host, absl::StrCat(own, ":"))) return true;
  }
  return false;
}

}  // namespace

std::string UrlEncoded(const std::string& text) {
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (absl::ascii_isalnum(byte) || absl::StrContains("-._~", std::string(1, c))) {
      encoded += c;
    } else {
      absl::StrAppendFormat(&encoded, "%%%02X", byte);
    }
  }
  return encoded;
}

absl::Status IdentityProviderOptions::Validate() const {
  const auto bad = [](absl::string_view key, absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("oidc.", key, ": ", what));
  };
  if (!absl::StartsWith(issuer, "https://") && !IsOnThisMachine(issuer)) {
    return bad("issuer", "give the provider's address, https://...; http:// only on this machine");
  }
  if (issuer.find_first_of("?# @") != std::string::npos) {
    return bad("issuer", "has no query, fragment or user");
  }
  if (client_id.empty())
    return bad("client_id", "is missing: under what name the provider knows this page");
  if (name.empty() || name.size() > 60) return bad("name", "give 1 to 60 bytes, for the button");
  if (!absl::StrContains(absl::StrCat(" ", scope, " "), " openid ")) {
    return bad("scope", "has to hold openid");
  }
  if (roles.empty() && other_role == AccessRole::kAnyone) {
    return bad("roles",
               "nobody would be let in: say which value of the claim is which role, or "
               "other_role");
  }
  return absl::OkStatus();
}

IssuerDocuments::IssuerDocuments(const IdentityProviderOptions& options) : issuer_(options.issuer) {
  fetch_.ca_file = options.ca_file;
  fetch_.plain = IsOnThisMachine(options.issuer);
}

absl::StatusOr<std::string> IssuerDocuments::Get(const std::string& url,
                                                 const std::stop_token& stop) {
  if (failed_ns_ != 0 && MonotonicNow() - failed_ns_ < kAfterFailure_ns) return failure_;
  absl::StatusOr<HttpAnswer> answer = Fetch(url, {}, fetch_, stop);
  failure_ = answer.status();
  if (answer.ok() && answer->status != 200) {
    failure_ = absl::UnavailableError(absl::StrCat(url, ": answered ", answer->status));
  }
  failed_ns_ = failure_.ok() ? 0 : MonotonicNow();
  if (failure_.ok()) return std::move(answer->body);
  failure_ = absl::UnavailableError(
      absl::StrCat("sign-in: the provider cannot be asked: ", failure_.message()));
  return failure_;
}

absl::StatusOr<HttpAnswer> IssuerDocuments::Post(
    const std::string& url, const std::vector<std::pair<std::string, std::string>>& form,
    const std::stop_token& stop) {
  absl::StatusOr<HttpAnswer> answer = Fetch(url, form, fetch_, stop);
  if (answer.ok()) return answer;
  return absl::UnavailableError(
      absl::StrCat("sign-in: the provider cannot be asked: ", answer.status().message()));
}

absl::Status IssuerDocuments::FetchEndpoints(const std::stop_token& stop) {
  const std::string url =
      absl::StrCat(absl::StripSuffix(issuer_, "/"), "/.well-known/openid-configuration");
  const absl::StatusOr<std::string> body = Get(url, stop);
  if (!body.ok()) return body.status();
  const nlohmann::json told = nlohmann::json::parse(*body, nullptr, /*allow_exceptions=*/false);
  const auto word = [&told](const char* key) {
    return told.is_object() && told.contains(key) && told[key].is_string()
               ? told[key].get<std::string>()
               : "";
  };
  if (word("issuer") != issuer_) {
    return absl::UnavailableError(absl::StrCat(
        "sign-in: ", url, ": is of another issuer than oidc.issuer says, to the letter"));
  }
  IssuerEndpoints found{word("authorization_endpoint"), word("token_endpoint"), word("jwks_uri")};
  for (const std::string* one : {&found.authorization, &found.token, &found.keys}) {
    const bool good = absl::StartsWith(*one, "https://") || (fetch_.plain && IsOnThisMachine(*one));
    if (good && one->size() <= kMaxUrlBytes) continue;
    return absl::UnavailableError(
        absl::StrCat("sign-in: ", url, ": an endpoint is missing, or not https"));
  }
  endpoints_ = found;
  endpoints_ns_ = MonotonicNow();
  return absl::OkStatus();
}

absl::StatusOr<IssuerEndpoints> IssuerDocuments::Endpoints(const std::stop_token& stop) {
  const bool kept = endpoints_ns_ != 0 && MonotonicNow() - endpoints_ns_ < kKeep_ns;
  if (kept) return endpoints_;
  if (absl::Status fetched = FetchEndpoints(stop); !fetched.ok()) return fetched;
  return endpoints_;
}

absl::Status IssuerDocuments::FetchKeys(const std::stop_token& stop) {
  const absl::StatusOr<IssuerEndpoints> endpoints = Endpoints(stop);
  if (!endpoints.ok()) return endpoints.status();
  const absl::StatusOr<std::string> body = Get(endpoints->keys, stop);
  if (!body.ok()) return body.status();
  absl::StatusOr<std::shared_ptr<const IssuerKeys>> keys = IssuerKeys::Parse(*body);
  if (!keys.ok()) {
    return absl::UnavailableError(
        absl::StrCat("sign-in: ", endpoints->keys, ": ", keys.status().message()));
  }
  keys_ = *std::move(keys);
  keys_ns_ = MonotonicNow();
  return absl::OkStatus();
}

absl::StatusOr<std::string> IssuerDocuments::Payload(const std::string& token,
                                                     const std::stop_token& stop) {
  const auto age_ns = [this] { return MonotonicNow() - keys_ns_; };
  if (keys_ == nullptr || age_ns() >= kKeep_ns) {
    if (absl::Status fetched = FetchKeys(stop); !fetched.ok()) return fetched;
  }
  absl::StatusOr<std::string> payload = VerifiedPayload(token, *keys_);
  if (absl::IsNotFound(payload.status()) && age_ns() >= kAgain_ns) {
    if (absl::Status fetched = FetchKeys(stop); !fetched.ok()) return fetched;
    payload = VerifiedPayload(token, *keys_);
  }
  if (absl::IsNotFound(payload.status())) {
    return absl::UnauthenticatedError(payload.status().message());
  }
  return payload;
}

}  // namespace saccade
