#include "client/net/trust.hpp"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>
#include <netdb.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

namespace saccade::net {
namespace {

constexpr int kPatience_s = 5;
constexpr std::size_t kMostBytes = 64 * 1024;

struct HostPort {
  std::string host, port;
};

// "https://[::1]:8080/trust", "10.0.0.7:8080".
absl::StatusOr<HostPort> Parse(absl::string_view address) {
  const std::string given(address);
  if (!absl::ConsumePrefix(&address, "https://")) absl::ConsumePrefix(&address, "http://");
  address = address.substr(0, address.find_first_of("/?#"));
  const std::size_t colon = address.rfind(':');
  if (colon == absl::string_view::npos || colon == 0 || colon + 1 == address.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "'", given, "' is not HOST:PORT of a server's page, for example 10.0.0.7:8080"));
  }
  absl::string_view host = address.substr(0, colon);
  if (absl::ConsumePrefix(&host, "[")) absl::ConsumeSuffix(&host, "]");
  return HostPort{std::string(host), std::string(address.substr(colon + 1))};
}

absl::Status NoAnswer(const std::string& address, const std::string& why) {
  return absl::UnavailableError(absl::StrCat("no page answers at ", address, ": ", why,
                                             "; name the server's HTTP address with --from"));
}

// A connected socket, which gives up after some seconds.
absl::StatusOr<int> Connect(const std::string& address, const HostPort& to) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int unknown = ::getaddrinfo(to.host.c_str(), to.port.c_str(), &hints, &found);
  if (unknown != 0) return NoAnswer(address, gai_strerror(unknown));
  const absl::Cleanup free = [found] { ::freeaddrinfo(found); };
  int why = ECONNREFUSED;
  for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
    const int socket = ::socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (socket < 0) continue;
    const timeval limit{kPatience_s, 0};
    (void)::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    (void)::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
    if (::connect(socket, at->ai_addr, at->ai_addrlen) == 0) return socket;
    why = errno;
    ::close(socket);
  }
  return NoAnswer(address, std::strerror(why));
}

}  // namespace

absl::StatusOr<std::string> FetchRoot(const std::string& address) {
  const absl::StatusOr<HostPort> to = Parse(address);
  if (!to.ok()) return to.status();
  const absl::StatusOr<int> socket = Connect(address, *to);
  if (!socket.ok()) return socket.status();
  const absl::Cleanup close = [&socket] { ::close(*socket); };
  const bool v6 = absl::StrContains(to->host, ':');
  const std::string request =
      absl::StrCat("GET /trust/saccade-root.pem HTTP/1.1\r\nHost: ", v6 ? "[" : "", to->host,
                   v6 ? "]" : "", ":", to->port, "\r\nConnection: close\r\n\r\n");
  if (::send(*socket, request.data(), request.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(request.size())) {
    return NoAnswer(address, std::strerror(errno));
  }
  std::string answer;
  std::array<char, 4096> piece;
  for (;;) {
    const ssize_t got = ::recv(*socket, piece.data(), piece.size(), 0);
    if (got < 0) return NoAnswer(address, std::strerror(errno));
    if (got == 0 || answer.size() > kMostBytes) break;
    answer.append(piece.data(), static_cast<std::size_t>(got));
  }
  const std::size_t body = answer.find("\r\n\r\n");
  const bool good = absl::StartsWith(answer, "HTTP/1.1 200 ") && body != std::string::npos;
  std::string pem = good ? answer.substr(body + 4) : "";
  if (!Fingerprint(pem).ok()) {
    return absl::NotFoundError(absl::StrCat(
        address,
        " offers no root: the server there has no authority of its own (it has a given "
        "certificate, or speaks plain HTTP), or is not Saccade's HTTP port"));
  }
  return OneRoot(pem);
}

absl::StatusOr<std::string> OneRoot(const std::string& pem) {
  const std::unique_ptr<BIO, int (*)(BIO*)> text(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), BIO_free);
  const std::unique_ptr<BIO, int (*)(BIO*)> clean(BIO_new(BIO_s_mem()), BIO_free);
  const auto read = [&text] {
    return std::unique_ptr<X509, void (*)(X509*)>(
        PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr), X509_free);
  };
  const auto root = read();
  if (root == nullptr) return absl::InvalidArgumentError("holds no certificate (PEM)");
  if (read() != nullptr) {
    return absl::InvalidArgumentError(
        "holds more than one certificate, of which only the first has that fingerprint: do not "
        "trust it");
  }
  ERR_clear_error();
  if (PEM_write_bio_X509(clean.get(), root.get()) != 1) {
    return absl::InternalError("the certificate cannot be written");
  }
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(clean.get(), &bytes);
  return std::string(bytes, static_cast<std::size_t>(size));
}

absl::StatusOr<std::string> Fingerprint(const std::string& pem) {
  const std::unique_ptr<BIO, int (*)(BIO*)> text(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), BIO_free);
  const std::unique_ptr<X509, void (*)(X509*)> certificate(
      PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr), X509_free);
  if (certificate == nullptr) return absl::InvalidArgumentError("holds no certificate (PEM)");
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_digest(certificate.get(), EVP_sha256(), digest.data(), &size);
  std::string words;
  for (unsigned i = 0; i < size; ++i) {
    absl::StrAppend(&words, i == 0 ? "" : ":", absl::StrFormat("%02X", digest[i]));
  }
  return words;
}

}  // namespace saccade::net
