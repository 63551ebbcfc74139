#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/identity/access_book.hpp"

namespace saccade {

/// The firm whose people sign in: [oidc] of the server's file.
struct IdentityProviderOptions {
  /// "https://login.firm.example": without a slash more or less than its own documents have. Plain
  /// http only on this machine.
  std::string issuer;
  std::string client_id;               // of the page, a public client
  std::string name = "your firm";      // on the button
  std::vector<std::string> audiences;  // of machines' tokens, besides client_id
  std::string scope = "openid profile email";
  std::string role_claim = "groups";            // "a.b": in another
  std::map<std::string, AccessRole> roles;      // by a value of that claim
  AccessRole other_role = AccessRole::kAnyone;  // of who has none of these; kAnyone: is not let in
  std::filesystem::path ca_file;                // PEM of whom to trust; empty: the system's store
  AccessBook::UnixClock now_unix_s;             // null: the system's

  /// InvalidArgument names the key.
  absl::Status Validate() const;
};

/// Where the browser goes to sign in.
struct SignInStart {
  std::string url, state;
};

/// The firm's OpenID Connect provider: sends browsers there (authorization code with PKCE), takes
/// their codes to it, and checks ID tokens by its keys, which it fetches anew once an hour, and
/// when a token names one that is not known.
///
/// One thread of its own asks the provider and answers, so nobody else waits for it; what it knows,
/// it looks for no sooner than it has to. Thread safe.
class IdentityProvider {
 public:
  template <typename T>
  using Done = std::function<void(absl::StatusOr<T>)>;

  /// Valid options. Fetches nothing yet.
  explicit IdentityProvider(IdentityProviderOptions options);
  ~IdentityProvider();

  const std::string& name() const;

  /// Keeps state, nonce and challenge for ten minutes. InvalidArgument: the fields of
  /// v1.BeginSignInRequest; Unavailable: the provider does not answer; ResourceExhausted.
  void Begin(std::string redirect_uri, std::string code_challenge, Done<SignInStart> done);
  /// What the browser came back with. Who it is, once the provider gave an ID token for the code.
  ///   Unauthenticated    state, verifier, code or token is not what it has to be
  ///   PermissionDenied   who signed in has no role here
  ///   Unavailable        the provider does not answer
  void Finish(std::string state, std::string code, std::string code_verifier, Done<SignedIn> done);
  /// An ID token that a machine brings. Errors as Finish.
  void Verify(std::string id_token, Done<SignedIn> done);

  /// Everything that waits is answered with Unavailable, and whatever comes. May be called twice.
  void Stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
