#include "tests/unit/server/identity/issuer.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>

namespace saccade::testing {
namespace {

constexpr char kDiscovery[] = "/.well-known/openid-configuration";

/// Head and body, as far as they came.
std::string ReadRequest(int socket) {
  std::string text;
  char buffer[4096];
  for (;;) {
    const std::size_t head = text.find("\r\n\r\n");
    if (head != std::string::npos) {
      std::size_t length = 0;
      const std::size_t field = text.find("Content-Length: ");
      if (field != std::string::npos) {
        const std::size_t from = field + 16;
        (void)absl::SimpleAtoi(text.substr(from, text.find("\r\n", from) - from), &length);
      }
      if (text.size() >= head + 4 + length) return text;
    }
    const ssize_t size = ::recv(socket, buffer, sizeof(buffer), 0);
    if (size <= 0) return text;
    text.append(buffer, static_cast<std::size_t>(size));
  }
}

}  // namespace

Issuer::Issuer() {
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_EQ(::listen(socket_, 16), 0);
  socklen_t size = sizeof(address);
  ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] {
    for (;;) {
      const int one = ::accept(socket_, nullptr, nullptr);
      if (one < 0) return;
      Serve(one);
      ::close(one);
    }
  });
}

Issuer::~Issuer() {
  ::shutdown(socket_, SHUT_RDWR);
  thread_.join();
  ::close(socket_);
}

std::string Issuer::url() const { return absl::StrCat("http://127.0.0.1:", port_); }

void Issuer::Set(const std::string& path, Reply reply) {
  const std::lock_guard guard(mutex_);
  replies_[path] = std::move(reply);
}

void Issuer::SetDiscovery(const std::map<std::string, std::string>& changes) {
  nlohmann::json document = {{"issuer", url()},
                             {"authorization_endpoint", url() + "/auth"},
                             {"token_endpoint", url() + "/token"},
                             {"jwks_uri", url() + "/keys"}};
  for (const auto& [name, value] : changes) document[name] = value;
  Set(kDiscovery, {200, document.dump()});
}

int Issuer::asked(const std::string& path) const {
  const std::lock_guard guard(mutex_);
  const auto found = asked_.find(path);
  return found == asked_.end() ? 0 : found->second;
}

std::string Issuer::last_body() const {
  const std::lock_guard guard(mutex_);
  return last_body_;
}

void Issuer::Serve(int socket) {
  const std::string request = ReadRequest(socket);
  const std::size_t begin = request.find(' ') + 1;
  const std::string path = request.substr(begin, request.find(' ', begin) - begin);
  Reply reply{404, "{}"};
  {
    const std::lock_guard guard(mutex_);
    ++asked_[path];
    const std::string body = request.substr(std::min(request.size(), request.find("\r\n\r\n") + 4));
    if (!body.empty()) last_body_ = body;
    if (const auto found = replies_.find(path); found != replies_.end()) reply = found->second;
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(reply.delay_ms));
  const std::string answer =
      absl::StrCat("HTTP/1.1 ", reply.status, " X\r\nConnection: close\r\n", reply.headers,
                   "Content-Length: ", reply.body.size(), "\r\n\r\n", reply.body);
  std::size_t sent = 0;
  while (sent < answer.size()) {
    const ssize_t size = ::send(socket, answer.data() + sent, answer.size() - sent, MSG_NOSIGNAL);
    if (size <= 0) return;
    sent += static_cast<std::size_t>(size);
  }
}

}  // namespace saccade::testing
