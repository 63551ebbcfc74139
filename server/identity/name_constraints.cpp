#include "server/identity/name_constraints.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>

#include <array>

namespace saccade {
namespace {

// Addresses that mean something else on every network: loopback, private (RFC 1918, 4193), shared
// (RFC 6598), link-local.
constexpr const char* kPrivate[] = {"127.0.0.0/255.0.0.0",
                                    "10.0.0.0/255.0.0.0",
                                    "172.16.0.0/255.240.0.0",
                                    "192.168.0.0/255.255.0.0",
                                    "100.64.0.0/255.192.0.0",
                                    "169.254.0.0/255.255.0.0",
                                    "::1/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff",
                                    "fc00::/fe00::",
                                    "fe80::/ffc0::"};

/// With its mask; empty: no address.
std::string NetworkOf(const std::string& address) {
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET, address.c_str(), bytes.data()) == 1) {
    return absl::StrCat(address, "/255.255.255.255");
  }
  if (inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1 || address == "::1") return "";
  for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = 0;
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (inet_ntop(AF_INET6, bytes.data(), text.data(), text.size()) == nullptr) return "";
  return absl::StrCat(text.data(), "/ffff:ffff:ffff:ffff::");
}

}  // namespace

std::string NameConstraints(const ServerNames& names) {
  std::string text = "critical";
  const auto permit = [&text](const char* kind, const std::string& value) {
    if (!value.empty()) absl::StrAppend(&text, ",permitted;", kind, ":", value);
  };
  for (const std::string& name : names.dns) {
    permit("DNS", name);
    if (!absl::StrContains(name, '.')) permit("DNS", absl::StrCat(name, ".local"));
  }
  for (const char* network : kPrivate) permit("IP", network);
  for (const std::string& address : names.addresses) permit("IP", NetworkOf(address));
  return text;
}

}  // namespace saccade
