#pragma once

#include <absl/strings/string_view.h>

#include <string>

namespace saccade {

/// An IP literal as the system writes it: `::ffff:192.0.2.1` is 192.0.2.1, no zone (`%eth0`), lower
/// case. What is none: as it is.
std::string PlainAddress(absl::string_view address);

/// By what a caller is counted: "ipv4:127.0.0.1", "ipv6:2001:db8:0:1" (the first 64 bits, one
/// household). `address` is an IP literal; an IPv4 caller of a socket for both is himself.
std::string PeerKey(absl::string_view address);

/// Of such a key the network: IPv4's first 24 bits, IPv6's first 48, what a provider gives one
/// customer.
std::string NetworkKey(absl::string_view peer);

/// Whether who is counted so is on this machine: loopback, a socket file, or the process itself.
bool IsThisMachine(absl::string_view peer);

/// The caller's address that a proxy's X-Forwarded-For tells: the last one, which the proxy itself
/// wrote; what stands before it, anybody may have. Empty: no IP literal stands there.
std::string ForwardedFor(absl::string_view header);

/// "Bearer TOKEN" without its first word; anything else as it is: no token of ours, and so refused.
absl::string_view TokenIn(absl::string_view authorization);

}  // namespace saccade
