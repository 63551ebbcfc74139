// What certificates say, and what this machine is called.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "server/identity/certificate.hpp"
#include "server/identity/openssl_owners.hpp"

namespace saccade {
namespace {

std::int64_t UnixOf(const ASN1_TIME* time) {
  std::tm parts{};
  return ASN1_TIME_to_tm(time, &parts) == 1 ? static_cast<std::int64_t>(timegm(&parts)) : 0;
}

std::string AddressText(int family, const void* bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  return inet_ntop(family, bytes, text.data(), text.size()) == nullptr ? "" : text.data();
}

ServerNames NamesOf(X509* certificate) {
  ServerNames names;
  const NamesOwner all(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; i < sk_GENERAL_NAME_num(all.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(all.get(), i);
    int kind = 0;
    const auto* value = static_cast<const ASN1_STRING*>(GENERAL_NAME_get0_value(name, &kind));
    const unsigned char* bytes = ASN1_STRING_get0_data(value);
    const int size = ASN1_STRING_length(value);
    if (kind == GEN_DNS) names.dns.emplace_back(bytes, bytes + size);
    if (kind == GEN_IPADD && (size == 4 || size == 16)) {
      names.addresses.push_back(AddressText(size == 4 ? AF_INET : AF_INET6, bytes));
    }
  }
  return names;
}

BioOwner BioOf(const std::string& text) {
  return BioOwner(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Which changes by itself, or means something else on every machine: no name for others.
bool LinkLocal(const sockaddr_in6& address) { return IN6_IS_ADDR_LINKLOCAL(&address.sin6_addr); }

}  // namespace

X509Owner ReadCertificate(const std::string& pem) {
  X509Owner certificate(PEM_read_bio_X509(BioOf(pem).get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return certificate;
}

KeyOwner ReadKey(const std::string& pem) {
  // Never asks a terminal for the password of an encrypted key.
  const auto no_password = [](char*, int, int, void*) { return 0; };
  KeyOwner key(PEM_read_bio_PrivateKey(BioOf(pem).get(), nullptr, no_password, nullptr));
  ERR_clear_error();
  return key;
}

absl::StatusOr<CertificateFacts> InspectCertificate(const std::string& pem) {
  const X509Owner certificate = ReadCertificate(pem);
  if (certificate == nullptr) return absl::InvalidArgumentError("holds no certificate (PEM)");
  CertificateFacts facts;
  facts.not_before_unix_s = UnixOf(X509_get0_notBefore(certificate.get()));
  facts.not_after_unix_s = UnixOf(X509_get0_notAfter(certificate.get()));
  facts.names = NamesOf(certificate.get());
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_digest(certificate.get(), EVP_sha256(), digest.data(), &size);
  for (unsigned i = 0; i < size; ++i) {
    absl::StrAppend(&facts.sha256, i == 0 ? "" : ":", absl::StrFormat("%02X", digest[i]));
  }
  return facts;
}

void ServerNames::Add(std::string host) {
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  if (host.empty()) return;
  std::array<unsigned char, 16> bytes{};
  const bool literal = inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
                       inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
  std::vector<std::string>& known = literal ? addresses : dns;
  if (std::find(known.begin(), known.end(), host) == known.end()) known.push_back(std::move(host));
}

std::vector<std::string> ServerNames::All() const {
  std::vector<std::string> all = dns;
  all.insert(all.end(), addresses.begin(), addresses.end());
  return all;
}

ServerNames ServerNames::OfThisMachine() {
  ServerNames names{{"localhost"}, {"127.0.0.1", "::1"}};
  std::array<char, 256> own{};
  if (gethostname(own.data(), own.size() - 1) == 0 && own[0] != '\0') {
    names.dns.emplace_back(own.data());
  }
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) != 0) return names;
  for (const ifaddrs* at = interfaces; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || (at->ifa_flags & IFF_UP) == 0) continue;
    std::string text;
    if (at->ifa_addr->sa_family == AF_INET) {
      text = AddressText(AF_INET, &reinterpret_cast<const sockaddr_in*>(at->ifa_addr)->sin_addr);
    } else if (at->ifa_addr->sa_family == AF_INET6) {
      const auto& address = *reinterpret_cast<const sockaddr_in6*>(at->ifa_addr);
      if (!LinkLocal(address)) text = AddressText(AF_INET6, &address.sin6_addr);
    }
    const auto& known = names.addresses;
    if (!text.empty() && std::find(known.begin(), known.end(), text) == known.end()) {
      names.addresses.push_back(text);
    }
  }
  freeifaddrs(interfaces);
  return names;
}

}  // namespace saccade
