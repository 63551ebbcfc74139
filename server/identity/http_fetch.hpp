#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

namespace saccade {

struct HttpFetchOptions {
  std::filesystem::path ca_file;  // PEM of whom to trust instead of the system's; empty: the latter
  bool plain = false;             // http:// as well: for an issuer on this machine
  std::size_t max_bytes = 256 * 1024;
  std::chrono::milliseconds patience{5000};  // from connecting to the last byte
};

struct HttpAnswer {
  long status = 0;
  std::string body;
};

/// Asks a web server, and waits for its answer: for a thread that has nothing else to do. TLS from
/// 1.2 with the certificate checked; redirects are not followed, no cookies, no user's passwords.
/// `form`: sent as a POST; empty: a GET.
///   Unavailable        no connection, no trust, no answer in time, or `stop`; says which
///   ResourceExhausted  the answer is larger than `max_bytes`
absl::StatusOr<HttpAnswer> Fetch(const std::string& url,
                                 const std::vector<std::pair<std::string, std::string>>& form,
                                 const HttpFetchOptions& options, const std::stop_token& stop);

}  // namespace saccade
