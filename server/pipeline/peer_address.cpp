#include "server/pipeline/peer_address.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <arpa/inet.h>

#include <array>

namespace saccade {
namespace {

constexpr absl::string_view kBearer = "bearer ";

bool IsLiteral(const std::string& text) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
}

}  // namespace

std::string PlainAddress(absl::string_view address) {
  const std::string text(address.substr(0, address.find('%')));
  in6_addr six{};
  if (inet_pton(AF_INET6, text.c_str(), &six) != 1) return text;
  std::array<char, INET6_ADDRSTRLEN> plain{};
  const bool mapped = IN6_IS_ADDR_V4MAPPED(&six);
  const void* from = mapped ? static_cast<const void*>(&six.s6_addr[12]) : &six;
  inet_ntop(mapped ? AF_INET : AF_INET6, from, plain.data(), plain.size());
  return plain.data();
}

std::string PeerKey(absl::string_view address) {
  const std::string plain = PlainAddress(address);
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET6, plain.c_str(), bytes.data()) != 1) return absl::StrCat("ipv4:", plain);
  if (IN6_IS_ADDR_LOOPBACK(reinterpret_cast<const in6_addr*>(bytes.data()))) return "ipv6:::1";
  std::string network = "ipv6:";
  for (std::size_t i = 0; i < 8; ++i)
    absl::StrAppend(&network, absl::Hex(bytes[i], absl::kZeroPad2));
  return network;
}

std::string NetworkKey(absl::string_view peer) {
  if (absl::StartsWith(peer, "ipv4:")) return std::string(peer.substr(0, peer.rfind('.')));
  return std::string(peer.substr(0, std::string_view("ipv6:").size() + 12));
}

bool IsThisMachine(absl::string_view peer) {
  return absl::StartsWith(peer, "ipv4:127.") || peer == "ipv6:::1" ||
         absl::StartsWith(peer, "unix") || absl::StartsWith(peer, "inproc");
}

std::string ForwardedFor(absl::string_view header) {
  const std::size_t comma = header.rfind(',');
  if (comma != absl::string_view::npos) header.remove_prefix(comma + 1);
  header = absl::StripAsciiWhitespace(header);
  if (absl::ConsumePrefix(&header, "[")) header = header.substr(0, header.find(']'));
  // "192.0.2.7:41000": some write the port as well.
  std::string address(header);
  if (!IsLiteral(address) && address.find(':') == address.rfind(':')) {
    address = address.substr(0, address.find(':'));
  }
  return IsLiteral(address) ? address : "";
}

absl::string_view TokenIn(absl::string_view authorization) {
  if (!absl::StartsWithIgnoreCase(authorization, kBearer)) return authorization;
  return absl::StripAsciiWhitespace(authorization.substr(kBearer.size()));
}

}  // namespace saccade
