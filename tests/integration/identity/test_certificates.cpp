#include "tests/integration/identity/test_certificates.hpp"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <memory>

namespace saccade::testing {
namespace {

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
};
using Bio = std::unique_ptr<BIO, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;
using Certificate = std::unique_ptr<X509, Free>;

std::string TextOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

void Extend(X509* certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Free> extension(
      X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  X509_add_ext(certificate, extension.get(), -1);
}

/// Signed by `issuer`; null: by itself.
TestPair Make(const std::string& common_name, const std::string& uri, int life_s,
              const TestPair* issuer) {
  const Key key(EVP_EC_gen("P-256"));
  const Certificate own(X509_new());
  X509_set_version(own.get(), X509_VERSION_3);
  static long serial = 1;
  ASN1_INTEGER_set(X509_get_serialNumber(own.get()), ++serial);
  X509_gmtime_adj(X509_getm_notBefore(own.get()), -2 * 86'400);
  X509_gmtime_adj(X509_getm_notAfter(own.get()), life_s);
  X509_NAME* name = X509_get_subject_name(own.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(common_name.c_str()), -1, -1,
                             0);
  X509_set_pubkey(own.get(), key.get());
  Extend(own.get(), NID_basic_constraints, issuer == nullptr ? "critical,CA:TRUE" : "CA:FALSE");
  if (!uri.empty()) Extend(own.get(), NID_subject_alt_name, "URI:" + uri);
  if (issuer == nullptr) {
    X509_set_issuer_name(own.get(), name);
    X509_sign(own.get(), key.get(), EVP_sha256());
  } else {
    const Bio pem(BIO_new_mem_buf(issuer->certificate_pem.data(), -1)),
        secret(BIO_new_mem_buf(issuer->key_pem.data(), -1));
    const Certificate above(PEM_read_bio_X509(pem.get(), nullptr, nullptr, nullptr));
    const Key signer(PEM_read_bio_PrivateKey(secret.get(), nullptr, nullptr, nullptr));
    X509_set_issuer_name(own.get(), X509_get_subject_name(above.get()));
    X509_sign(own.get(), signer.get(), EVP_sha256());
  }
  const Bio certificate_text(BIO_new(BIO_s_mem())), key_text(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(certificate_text.get(), own.get());
  PEM_write_bio_PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  return {TextOf(certificate_text.get()), TextOf(key_text.get())};
}

}  // namespace

TestAuthority::TestAuthority(const std::string& common_name)
    : own_(Make(common_name, "", 86'400, nullptr)) {}

TestPair TestAuthority::Issue(const std::string& common_name, const std::string& uri,
                              int life_s) const {
  return Make(common_name, uri, life_s, &own_);
}

}  // namespace saccade::testing
