#include "server/identity/http_fetch.hpp"

#include <absl/strings/str_cat.h>
#include <curl/curl.h>

#include <memory>

namespace saccade {
namespace {

struct Delete {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

struct Receiver {
  std::string body;
  std::size_t max_bytes = 0;
  bool too_large = false;
};

std::size_t Receive(char* data, std::size_t size, std::size_t count, void* to) {
  auto& receiver = *static_cast<Receiver*>(to);
  const std::size_t bytes = size * count;
  receiver.too_large = receiver.body.size() + bytes > receiver.max_bytes;
  if (receiver.too_large) return 0;  // ends the transfer
  receiver.body.append(data, bytes);
  return bytes;
}

int Stopped(void* stop, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<const std::stop_token*>(stop)->stop_requested() ? 1 : 0;
}

std::string Encoded(CURL* curl, const std::string& text) {
  char* escaped = curl_easy_escape(curl, text.data(), static_cast<int>(text.size()));
  std::string copy(escaped == nullptr ? "" : escaped);
  curl_free(escaped);
  return copy;
}

// Once, before any other thread of the program asks for anything.
bool Ready() {
  static const bool ready = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
  return ready;
}

}  // namespace

absl::StatusOr<HttpAnswer> Fetch(const std::string& url,
                                 const std::vector<std::pair<std::string, std::string>>& form,
                                 const HttpFetchOptions& options, const std::stop_token& stop) {
  const std::unique_ptr<CURL, Delete> curl(Ready() ? curl_easy_init() : nullptr);
  if (curl == nullptr) return absl::UnavailableError("the HTTP library cannot be started");
  Receiver receiver{{}, options.max_bytes, false};
  std::stop_token stopped = stop;
  const std::unique_ptr<curl_slist, Delete> headers(
      curl_slist_append(nullptr, "Accept: application/json"));
  std::string body;
  for (const auto& [name, value] : form) {
    absl::StrAppend(&body, body.empty() ? "" : "&", name, "=", Encoded(curl.get(), value));
  }
  const auto set = [&curl](CURLoption option, auto value) {
    return curl_easy_setopt(curl.get(), option, value) == CURLE_OK;
  };
  const char* protocols = options.plain ? "https,http" : "https";
  bool good = set(CURLOPT_URL, url.c_str()) && set(CURLOPT_PROTOCOLS_STR, protocols) &&
              set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2)) &&
              set(CURLOPT_NETRC, static_cast<long>(CURL_NETRC_IGNORED)) &&
              set(CURLOPT_NOSIGNAL, 1L) && set(CURLOPT_FOLLOWLOCATION, 0L) &&
              set(CURLOPT_TIMEOUT_MS, static_cast<long>(options.patience.count())) &&
              set(CURLOPT_HTTPHEADER, headers.get()) && set(CURLOPT_USERAGENT, "saccade-server") &&
              set(CURLOPT_WRITEFUNCTION, &Receive) && set(CURLOPT_WRITEDATA, &receiver) &&
              set(CURLOPT_NOPROGRESS, 0L) && set(CURLOPT_XFERINFOFUNCTION, &Stopped) &&
              set(CURLOPT_XFERINFODATA, &stopped);
  if (!options.ca_file.empty()) {
    good = good && set(CURLOPT_CAINFO, options.ca_file.c_str()) &&
           set(CURLOPT_CAPATH, static_cast<const char*>(nullptr));
  }
  if (!form.empty()) {
    good = good && set(CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size())) &&
           set(CURLOPT_COPYPOSTFIELDS, body.c_str());
  }
  if (!good) return absl::UnavailableError("the HTTP library lacks what is needed");
  const CURLcode code = curl_easy_perform(curl.get());
  if (receiver.too_large) {
    return absl::ResourceExhaustedError(
        absl::StrCat(url, ": the answer is larger than ", options.max_bytes, " bytes"));
  }
  if (code != CURLE_OK) {
    return absl::UnavailableError(absl::StrCat(url, ": ", curl_easy_strerror(code)));
  }
  HttpAnswer answer{0, std::move(receiver.body)};
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer.status);
  return answer;
}

}  // namespace saccade
