#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>

namespace saccade {

struct OpenSslFree {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
  void operator()(NAME_CONSTRAINTS* constraints) const { NAME_CONSTRAINTS_free(constraints); }
  void operator()(GENERAL_NAMES* names) const { GENERAL_NAMES_free(names); }
};
using BioOwner = std::unique_ptr<BIO, OpenSslFree>;
using KeyOwner = std::unique_ptr<EVP_PKEY, OpenSslFree>;
using X509Owner = std::unique_ptr<X509, OpenSslFree>;
using ExtensionOwner = std::unique_ptr<X509_EXTENSION, OpenSslFree>;
using ConstraintsOwner = std::unique_ptr<NAME_CONSTRAINTS, OpenSslFree>;
using NamesOwner = std::unique_ptr<GENERAL_NAMES, OpenSslFree>;

/// The first of a PEM text; null if there is none.
X509Owner ReadCertificate(const std::string& pem);
KeyOwner ReadKey(const std::string& pem);

}  // namespace saccade
