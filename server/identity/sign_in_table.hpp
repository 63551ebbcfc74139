#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// InvalidArgument names the field of v1.BeginSignInRequest.
absl::Status CheckSignInRequest(const std::string& redirect_uri, const std::string& code_challenge);

/// Sign-ins that were begun: each is taken once, within ten minutes. One thread.
class SignInTable {
 public:
  struct Begun {
    std::string state, nonce;  // 256 random bits each
    std::string redirect_uri, challenge;
    Timestamp begun_ns = 0;
  };
  /// Where there are a thousand, the oldest goes.
  Begun Begin(const std::string& redirect_uri, const std::string& challenge, Timestamp now_ns);
  /// Unauthenticated: no such state (any more), or the verifier is not the one of its challenge.
  absl::StatusOr<Begun> Take(const std::string& state, const std::string& verifier,
                             Timestamp now_ns);

 private:
  absl::flat_hash_map<std::string, Begun> begun_;  // by state
};

}  // namespace saccade
