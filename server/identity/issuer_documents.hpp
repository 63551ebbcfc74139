#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/identity/http_fetch.hpp"
#include "server/identity/id_token.hpp"
#include "server/identity/identity_provider.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// As in a query or a form.
std::string UrlEncoded(const std::string& text);

/// Where an issuer is asked for what: from its discovery document.
struct IssuerEndpoints {
  std::string authorization, token, keys;
};

/// What an issuer tells of itself, fetched and kept: its endpoints, and its keys for an hour. Keys
/// are fetched anew for a token that names an unknown one, at most every five seconds; who did not
/// answer is not asked again for as long. One thread, which waits.
class IssuerDocuments {
 public:
  explicit IssuerDocuments(const IdentityProviderOptions& options);

  /// Unavailable: no answer, or not what an issuer says; with the address.
  absl::StatusOr<IssuerEndpoints> Endpoints(const std::stop_token& stop);
  /// As VerifiedPayload, by the issuer's keys; Unavailable as above; Unauthenticated where it has
  /// no such key.
  absl::StatusOr<std::string> Payload(const std::string& token, const std::stop_token& stop);
  absl::StatusOr<HttpAnswer> Post(const std::string& url,
                                  const std::vector<std::pair<std::string, std::string>>& form,
                                  const std::stop_token& stop);

 private:
  absl::StatusOr<std::string> Get(const std::string& url, const std::stop_token& stop);
  absl::Status FetchEndpoints(const std::stop_token& stop);
  absl::Status FetchKeys(const std::stop_token& stop);

  const std::string issuer_;
  HttpFetchOptions fetch_;
  IssuerEndpoints endpoints_;
  std::shared_ptr<const IssuerKeys> keys_;
  Timestamp keys_ns_ = 0, endpoints_ns_ = 0;  // when they were fetched
  Timestamp failed_ns_ = 0;                   // 0: the last time it answered
  absl::Status failure_;
};

}  // namespace saccade
