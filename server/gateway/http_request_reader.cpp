#include "server/gateway/http_request_reader.hpp"

#include <exception>

namespace saccade {

namespace http = boost::beast::http;

HttpRequestReader::HttpRequestReader(std::size_t max_head_bytes, std::size_t max_body_bytes)
    : max_head_bytes_(max_head_bytes), max_body_bytes_(max_body_bytes) {
  parser_.eager(true);
  parser_.header_limit(static_cast<std::uint32_t>(max_head_bytes));
  parser_.body_limit(max_body_bytes);
}

HttpRequestReader::Result HttpRequestReader::Take(boost::beast::flat_buffer& buffer) {
  // Beast's fields throw std::length_error on a value of 64 KiB, its body std::bad_alloc.
  try {
    return Parse(buffer);
  } catch (const std::exception&) {
    return Result::kMalformed;
  }
}

std::size_t HttpRequestReader::announced_body_bytes() const {
  if (parser_.chunked()) return max_body_bytes_;
  const auto length = parser_.content_length();
  return length ? static_cast<std::size_t>(*length) : 0;
}

// Chunks may be cut small, so as many bytes as the body has are theirs; the rest has one limit.
bool HttpRequestReader::Wasteful(std::size_t waiting) const {
  const std::size_t body = parser_.get().body().size();
  return taken_ + waiting > 2 * max_head_bytes_ + 2 * body;
}

HttpRequestReader::Result HttpRequestReader::Parse(boost::beast::flat_buffer& buffer) {
  while (!parser_.is_done()) {
    if (buffer.size() == 0) return Result::kNeedMore;
    boost::system::error_code error;
    const std::size_t used = parser_.put(buffer.data(), error);
    buffer.consume(used);
    taken_ += used;
    if (error == http::error::body_limit) return Result::kBodyTooLarge;
    if (error == http::error::header_limit) return Result::kHeadTooLarge;
    if (error && error != http::error::need_more) return Result::kMalformed;
    const bool stuck = error == http::error::need_more;
    if (Wasteful(stuck ? buffer.size() : 0)) return Result::kHeadTooLarge;
    if (stuck) return Result::kNeedMore;
    if (used == 0) return Result::kMalformed;  // neither forward nor an error: never seen
  }
  return Result::kDone;
}

}  // namespace saccade
