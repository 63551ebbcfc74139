#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>

#include "server/app/server_config.hpp"

namespace saccade {

absl::StatusOr<Address> Address::Parse(const std::string& text, const std::string& flag) {
  const auto bad = [&](const char* problem) {
    return absl::InvalidArgumentError(
        absl::StrCat(flag, ": '", text, "' ", problem, ", e.g. 127.0.0.1:50051"));
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return bad("is not HOST:PORT");
  Address address;
  address.host = text.substr(0, colon);
  if (!absl::SimpleAtoi(text.substr(colon + 1), &address.port) || address.port < 0 ||
      address.port > 65535) {
    return bad("has no port from 0 to 65535");
  }
  if (address.host == "localhost") address.host = "127.0.0.1";
  const bool brackets = address.host.size() > 2 && address.host.front() == '[';
  if (brackets) address.host = address.host.substr(1, address.host.size() - 2);
  unsigned char bytes[16];
  const int family = brackets ? AF_INET6 : AF_INET;
  if (inet_pton(family, address.host.c_str(), bytes) != 1) return bad("needs an IP address");
  return address;
}

bool Address::loopback() const { return host.rfind("127.", 0) == 0 || host == "::1"; }

std::string Address::ToString(int actual_port) const {
  const bool v6 = host.find(':') != std::string::npos;
  return v6 ? absl::StrCat("[", host, "]:", actual_port) : absl::StrCat(host, ":", actual_port);
}

}  // namespace saccade
