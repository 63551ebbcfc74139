#include "server/identity/certificate.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <ctime>
#include <memory>

#include "server/identity/name_constraints.hpp"
#include "server/identity/openssl_owners.hpp"

namespace saccade {
namespace {

constexpr std::int64_t kDay_s = 86'400;
constexpr std::int64_t kAuthorityLife_s = 3650 * kDay_s;
constexpr std::int64_t kServerLife_s = 397 * kDay_s;

absl::Status Failed(const char* what) {
  const unsigned long code = ERR_get_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  return absl::InternalError(
      absl::StrCat("certificate: ", what, " failed", reason ? ": " : "", reason ? reason : ""));
}

std::string TextOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

absl::StatusOr<CertificateAndKey> ToPem(X509* certificate, EVP_PKEY* key) {
  const BioOwner certificate_text(BIO_new(BIO_s_mem())), key_text(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_X509(certificate_text.get(), certificate) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1) {
    return Failed("writing PEM");
  }
  return CertificateAndKey{TextOf(certificate_text.get()), TextOf(key_text.get())};
}

bool AddExtension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const ExtensionOwner extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  return extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// With serial number, dates, key and subject; neither extensions nor signature.
X509Owner Blank(EVP_PKEY* key, const std::string& common_name, std::int64_t life_s) {
  X509Owner certificate(X509_new());
  if (certificate == nullptr) return nullptr;
  std::uint64_t serial = 0;
  if (RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof(serial)) != 1) return nullptr;
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate.get()), serial >> 1 | 1);
  // Yesterday: a phone's clock may be behind.
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), life_s - kDay_s);
  X509_NAME* name = X509_get_subject_name(certificate.get());
  const auto* text = reinterpret_cast<const unsigned char*>(common_name.c_str());
  if (X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, text, -1, -1, 0) != 1 ||
      X509_set_pubkey(certificate.get(), key) != 1) {
    return nullptr;
  }
  return certificate;
}

std::string AlternativeNames(const ServerNames& names) {
  std::vector<std::string> all;
  for (const std::string& name : names.dns) all.push_back(absl::StrCat("DNS:", name));
  for (const std::string& address : names.addresses) all.push_back(absl::StrCat("IP:", address));
  return absl::StrJoin(all, ",");
}

bool MayName(const NAME_CONSTRAINTS* constraints, const ServerNames& one) {
  const X509Owner probe(X509_new());
  if (probe == nullptr ||
      !AddExtension(probe.get(), probe.get(), NID_subject_alt_name, AlternativeNames(one))) {
    return false;
  }
  // The check looks at what this has read of the extensions.
  X509_check_purpose(probe.get(), -1, 0);
  return NAME_CONSTRAINTS_check(probe.get(), const_cast<NAME_CONSTRAINTS*>(constraints)) ==
         X509_V_OK;
}

}  // namespace

ServerNames PermittedBy(const std::string& authority_pem, const ServerNames& names) {
  const X509Owner authority = ReadCertificate(authority_pem);
  if (authority == nullptr) return {};
  const ConstraintsOwner constraints(static_cast<NAME_CONSTRAINTS*>(
      X509_get_ext_d2i(authority.get(), NID_name_constraints, nullptr, nullptr)));
  if (constraints == nullptr) return names;
  ServerNames permitted;
  for (const std::string& name : names.dns) {
    if (MayName(constraints.get(), {{name}, {}})) permitted.dns.push_back(name);
  }
  for (const std::string& address : names.addresses) {
    if (MayName(constraints.get(), {{}, {address}})) permitted.addresses.push_back(address);
  }
  ERR_clear_error();
  return permitted;
}

absl::StatusOr<CertificateAndKey> MakeAuthority(const std::string& common_name,
                                                const ServerNames& names) {
  const KeyOwner key(EVP_EC_gen("P-256"));
  if (key == nullptr) return Failed("making a key");
  // A common name has at most 64 bytes.
  const X509Owner certificate = Blank(key.get(), common_name.substr(0, 64), kAuthorityLife_s);
  if (certificate == nullptr) return Failed("making the authority");
  X509* own = certificate.get();
  X509_set_issuer_name(own, X509_get_subject_name(own));
  if (!AddExtension(own, own, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") ||
      !AddExtension(own, own, NID_key_usage, "critical,keyCertSign,cRLSign") ||
      !AddExtension(own, own, NID_ext_key_usage, "serverAuth") ||
      !AddExtension(own, own, NID_subject_key_identifier, "hash") ||
      (!names.All().empty() &&
       !AddExtension(own, own, NID_name_constraints, NameConstraints(names))) ||
      X509_sign(own, key.get(), EVP_sha256()) == 0) {
    return Failed("signing the authority");
  }
  return ToPem(own, key.get());
}

absl::StatusOr<CertificateAndKey> MakeServerCertificate(const CertificateAndKey& authority,
                                                        const ServerNames& names) {
  const X509Owner issuer = ReadCertificate(authority.certificate_pem);
  const KeyOwner issuer_key = ReadKey(authority.key_pem);
  if (issuer == nullptr || issuer_key == nullptr) return Failed("reading the authority");
  const KeyOwner key(EVP_EC_gen("P-256"));
  if (key == nullptr) return Failed("making a key");
  const std::string name = names.dns.empty() ? "saccade" : names.dns.back().substr(0, 64);
  const X509Owner certificate = Blank(key.get(), name, kServerLife_s);
  if (certificate == nullptr) return Failed("making the certificate");
  X509* own = certificate.get();
  X509_set_issuer_name(own, X509_get_subject_name(issuer.get()));
  if (!AddExtension(own, issuer.get(), NID_basic_constraints, "critical,CA:FALSE") ||
      !AddExtension(own, issuer.get(), NID_key_usage, "critical,digitalSignature") ||
      !AddExtension(own, issuer.get(), NID_ext_key_usage, "serverAuth") ||
      !AddExtension(own, issuer.get(), NID_subject_key_identifier, "hash") ||
      !AddExtension(own, issuer.get(), NID_authority_key_identifier, "keyid:always") ||
      !AddExtension(own, issuer.get(), NID_subject_alt_name, AlternativeNames(names)) ||
      X509_sign(own, issuer_key.get(), EVP_sha256()) == 0) {
    return Failed("signing the certificate");
  }
  return ToPem(own, key.get());
}

absl::Status CheckPair(const std::string& certificate_pem, const std::string& key_pem) {
  const X509Owner certificate = ReadCertificate(certificate_pem);
  if (certificate == nullptr) return absl::InvalidArgumentError("holds no certificate (PEM)");
  const KeyOwner key = ReadKey(key_pem);
  if (key == nullptr) return absl::InvalidArgumentError("the key is no private key (PEM)");
  if (X509_check_private_key(certificate.get(), key.get()) == 1) return absl::OkStatus();
  ERR_clear_error();
  return absl::InvalidArgumentError("certificate and key are not of the same pair");
}

bool SignedBy(const std::string& certificate_pem, const std::string& authority_pem) {
  const X509Owner certificate = ReadCertificate(certificate_pem);
  const X509Owner authority = ReadCertificate(authority_pem);
  if (certificate == nullptr || authority == nullptr) return false;
  const KeyOwner key(X509_get_pubkey(authority.get()));
  const bool valid = key != nullptr && X509_verify(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  return valid;
}

}  // namespace saccade
