#include "server/gateway/host_check.hpp"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace saccade {
namespace {

// "name:port" without its port; "[::1]:port" without brackets.
absl::string_view NameOf(absl::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    return end == absl::string_view::npos ? absl::string_view() : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool IsIpLiteral(const std::string& name) {
  std::array<unsigned char, sizeof(in6_addr)> address;
  return inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
}

}  // namespace

HostCheck::HostCheck(const std::vector<std::string>& also) : names_{"localhost"} {
  std::array<char, 256> own{};
  if (gethostname(own.data(), own.size() - 1) == 0)
    names_.push_back(absl::AsciiStrToLower(own.data()));
  for (const std::string& name : also) names_.push_back(absl::AsciiStrToLower(name));
}

bool HostCheck::HostAllowed(absl::string_view host) const {
  const std::string name = absl::AsciiStrToLower(NameOf(host));
  if (name.empty()) return false;
  return IsIpLiteral(name) || std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool HostCheck::OriginAllowed(absl::string_view origin, absl::string_view host) {
  if (origin.empty()) return true;
  for (const absl::string_view scheme : {"http://", "https://"}) {
    if (absl::StartsWithIgnoreCase(origin, scheme)) {
      return absl::EqualsIgnoreCase(origin.substr(scheme.size()), host);
    }
  }
  return false;
}

}  // namespace saccade
