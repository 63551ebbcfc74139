#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace saccade {

struct HttpReply {
  int status = 0;
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;                            // chunks joined
};

/// One frame of a gRPC-Web body.
struct WebFrame {
  bool trailers = false;
  std::string payload;
};

/// A blocking HTTP/1.1 client on a plain socket, for tests.
class HttpClient {
 public:
  /// `receive_buffer_bytes` above 0 makes the kernel hold no more than about that.
  explicit HttpClient(int port, int receive_buffer_bytes = 0);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  void Send(const std::string& bytes) const;
  /// GET with Host localhost and the given header lines ("Name: value\r\n" each).
  HttpReply Get(const std::string& target, const std::string& header_lines = "");
  /// Sends one gRPC-Web request; read its answer with `ReadReply` or piece by piece.
  void SendCall(const std::string& method, const std::string& message,
                const std::string& header_lines = "") const;
  HttpReply Call(const std::string& method, const std::string& message,
                 const std::string& header_lines = "");

  HttpReply ReadReply(bool head_only = false);
  /// The next chunk of a reply whose head was read; nothing at its end.
  std::optional<std::string> ReadChunk();
  /// True if the server closes within `timeout`.
  bool ClosedWithin(std::chrono::milliseconds timeout) const;
  void Close();

 private:
  bool Fill();
  std::string ReadLine();
  std::string ReadBytes(std::size_t size);

  int socket_ = -1;
  std::string buffer_;
};

std::vector<WebFrame> SplitFrames(const std::string& body);

}  // namespace saccade
