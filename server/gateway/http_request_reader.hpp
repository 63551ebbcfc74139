#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstddef>

namespace saccade {

/// Makes one request of bytes as they come, and bounds what they may cost.
///
/// One limit for everything that is not body: head, chunk heads with their extensions, and
/// trailers. What the parser throws ends here. Needs no socket.
class HttpRequestReader {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  enum class Result {
    kNeedMore,      // everything in the buffer was looked at
    kDone,          // `request` is whole; what follows it stays in the buffer
    kBodyTooLarge,  // `request` has its head
    kHeadTooLarge,  // more head, chunk heads or trailers than `max_head_bytes`
    kMalformed,
  };

  HttpRequestReader(std::size_t max_head_bytes, std::size_t max_body_bytes);

  /// Takes what it can from `buffer`. Nothing is to be asked after a refusal.
  Result Take(boost::beast::flat_buffer& buffer);

  const Request& request() const { return parser_.get(); }

  /// Whether the head is there, which says what the rest will be.
  bool head_done() const { return parser_.is_header_done(); }
  /// Bytes of the body to come, as the head says; where it does not (chunks), the most there may
  /// be.
  std::size_t announced_body_bytes() const;

 private:
  Result Parse(boost::beast::flat_buffer& buffer);
  bool Wasteful(std::size_t waiting) const;

  const std::size_t max_head_bytes_, max_body_bytes_;
  boost::beast::http::request_parser<boost::beast::http::string_body> parser_;
  std::size_t taken_ = 0;  // bytes of this request, all kinds
};

}  // namespace saccade
