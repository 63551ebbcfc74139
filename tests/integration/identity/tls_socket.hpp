#pragma once

#include <arpa/inet.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>

namespace saccade::testing {

/// A TLS connection to 127.0.0.1, with its socket.
class TlsSocket {
 public:
  /// `receive_buffer_bytes` 0: the system's choice.
  TlsSocket(int port, const std::string& root_pem, int least, int most,
            int receive_buffer_bytes = 0) {
    context_.reset(SSL_CTX_new(TLS_client_method()));
    SSL_CTX_set_min_proto_version(context_.get(), least);
    SSL_CTX_set_max_proto_version(context_.get(), most);
    const std::unique_ptr<BIO, int (*)(BIO*)> text(
        BIO_new_mem_buf(root_pem.data(), static_cast<int>(root_pem.size())), BIO_free);
    const std::unique_ptr<X509, void (*)(X509*)> root(
        PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr), X509_free);
    if (root) X509_STORE_add_cert(SSL_CTX_get_cert_store(context_.get()), root.get());
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer_bytes > 0) {
      (void)::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(int));
    }
    const timeval limit{0, 100'000};  // looked at again and again
    (void)::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) return;
    ssl_.reset(SSL_new(context_.get()));
    SSL_set_fd(ssl_.get(), socket_);
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_.get()), "127.0.0.1");
    for (int tries = 0; tries < 100 && !open_; ++tries) {
      const int done = SSL_connect(ssl_.get());
      open_ = done == 1;
      if (!open_ && SSL_get_error(ssl_.get(), done) != SSL_ERROR_WANT_READ) return;
    }
  }
  ~TlsSocket() {
    ssl_.reset();
    if (socket_ >= 0) ::close(socket_);
    ERR_clear_error();
  }

  TlsSocket(const TlsSocket&) = delete;
  TlsSocket& operator=(const TlsSocket&) = delete;

  bool open() const { return open_; }
  bool verified() const { return open_ && SSL_get_verify_result(ssl_.get()) == X509_V_OK; }
  /// DER; empty: none.
  std::string PeerCertificate() const {
    const std::unique_ptr<X509, void (*)(X509*)> peer(SSL_get1_peer_certificate(ssl_.get()),
                                                      X509_free);
    unsigned char* bytes = nullptr;
    const int size = peer == nullptr ? 0 : i2d_X509(peer.get(), &bytes);
    std::string der(reinterpret_cast<char*>(bytes), size > 0 ? static_cast<std::size_t>(size) : 0);
    OPENSSL_free(bytes);
    return der;
  }
  bool Write(const std::string& bytes) {
    return SSL_write(ssl_.get(), bytes.data(), static_cast<int>(bytes.size())) > 0;
  }
  /// False at the end; empty: nothing came for a moment.
  bool Read(std::string& piece) {
    std::array<char, 16384> buffer;
    const int got = SSL_read(ssl_.get(), buffer.data(), buffer.size());
    piece.assign(buffer.data(), got > 0 ? static_cast<std::size_t>(got) : 0);
    return got > 0 || SSL_get_error(ssl_.get(), got) == SSL_ERROR_WANT_READ;
  }

 private:
  struct Free {
    void operator()(SSL* ssl) const { SSL_free(ssl); }
    void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
  };
  std::unique_ptr<SSL_CTX, Free> context_;
  std::unique_ptr<SSL, Free> ssl_;
  int socket_ = -1;
  bool open_ = false;
};

}  // namespace saccade::testing
