// saccade-decode: a video in, pictures out, shut in. Started by a server, not by people.
#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "server/capture/video/decoder.hpp"
#include "server/capture/video/packet_loop.hpp"
#include "server/capture/video/picture_writer.hpp"
#include "server/capture/video/sandbox.hpp"
#include "shared/version/version.hpp"

namespace saccade {
namespace {

constexpr char kHelp[] =
    "usage: saccade-decode [--after NS] < VIDEO | saccade-decode --stream < ADDRESS\n"
    "       saccade-decode --packets [--most-pixels N] < PACKETS\n"
    "       saccade-decode --try-sandbox [--network] | --version\n"
    "Decodes a video and writes its pictures to standard output, in a form of its own.\n"
    "saccade-server starts it for file:, rtsp: and phone: sources.\n";

constexpr std::size_t kMostAddressBytes = 4096;

/// The host by its number: in the sandbox no file can be opened, and names are looked up in files.
std::string WithAddress(const std::string& url) {
  const std::size_t begin = url.find("://");
  if (begin == std::string::npos) return url;
  const std::size_t end = url.find('/', begin + 3);
  const std::size_t at = url.rfind('@', end);
  const std::size_t host = at != std::string::npos && at > begin ? at + 1 : begin + 3;
  if (host < url.size() && url[host] == '[') return url;  // IPv6 literal
  std::size_t host_end = url.find(':', host);
  if (host_end == std::string::npos || host_end > end) host_end = end;
  const std::string name = url.substr(host, host_end - host);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(name.c_str(), nullptr, &hints, &found) != 0) return url;
  char number[NI_MAXHOST] = {};
  getnameinfo(found->ai_addr, found->ai_addrlen, number, sizeof number, nullptr, 0, NI_NUMERICHOST);
  const std::string address =
      found->ai_family == AF_INET6 ? "[" + std::string(number) + "]" : std::string(number);
  freeaddrinfo(found);
  return url.substr(0, host) + address +
         (host_end == std::string::npos ? "" : url.substr(host_end));
}

/// rtsp://HOST[:PORT]/PATH from standard input: it may hold a password, and every account of the
/// machine sees the words that a process was started with.
std::string ReadAddress() {
  std::string address(kMostAddressBytes, '\0');
  std::size_t size = 0;
  while (size < address.size()) {
    const ssize_t got = read(STDIN_FILENO, address.data() + size, address.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
  }
  address.resize(size);
  return address;
}

int Main(int argc, char** argv) {
  DecodeRequest request;
  bool attempt = false, network = false, packets = false;
  std::int64_t most_pixels = kMostPacketPixels;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool has_value = i + 1 < argc;
    if (word == "--after" && has_value) {
      request.after_ns = std::atoll(argv[++i]);
    } else if (word == "--stream") {
      request.url = ReadAddress();
    } else if (word == "--try-sandbox") {
      attempt = true;
    } else if (word == "--packets") {
      packets = true;
    } else if (word == "--most-pixels" && has_value) {
      most_pixels = std::atoll(argv[++i]);
    } else if (word == "--network") {
      network = true;
    } else if (word == "--version") {
      std::printf("saccade-decode %s\n", Version());
      return 0;
    } else {
      const bool asked = word == "--help";
      std::fputs(kHelp, asked ? stdout : stderr);
      return asked ? 0 : 2;
    }
  }
  if (!request.url.empty()) request.url = WithAddress(request.url);
  const std::string problem = EnterSandbox(network || !request.url.empty());
  if (attempt && problem.empty()) {
    const std::string tried = TrySandbox();
    return write(1, tried.data(), tried.size()) < 0 ? 1 : 0;
  }
  if (problem.empty()) return packets ? DecodePackets(most_pixels) : DecodeVideo(request);
  WriteError("the decoder's sandbox cannot be had: " + problem);
  return 1;
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) { return saccade::Main(argc, argv); }
