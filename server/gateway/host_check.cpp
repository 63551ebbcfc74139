#include "server/gateway/host_check.hpp"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace saccade {
namespace {

// "", or ":" and digits.
bool IsPort(absl::string_view rest) {
  return rest.empty() ||
         (rest.front() == ':' && std::all_of(rest.begin() + 1, rest.end(), absl::ascii_isdigit));
}

// "name:port" without its port; "[::1]:port" without brackets. Empty: it is neither.
absl::string_view NameOf(absl::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    if (end == absl::string_view::npos || !IsPort(host.substr(end + 1))) return {};
    return host.substr(1, end - 1);
  }
  const std::size_t end = std::min(host.find(':'), host.size());
  return IsPort(host.substr(end)) ? host.substr(0, end) : absl::string_view();
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
