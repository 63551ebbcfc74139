#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "client/net/connection.hpp"
#include "client/net/surface_types.hpp"

namespace saccade::session {

/// Fetches surfaces beside everything else, on a thread of its own: a piece at a time, with a pause
/// as long as the last piece took, so that it never has more than half of a bad link.
class SurfaceFetcher {
 public:
  /// `took` gets each piece, on the fetcher's thread.
  explicit SurfaceFetcher(std::function<void(net::SurfacePiece)> took);
  ~SurfaceFetcher() = default;

  /// Another session, or the same anew.
  void Connect(const net::ConnectionOptions& options);
  void Tell(const net::SurfaceNews& news);

 private:
  void Run(std::stop_token stop);

  const std::function<void(net::SurfacePiece)> took_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<net::ConnectionOptions> options_;
  std::uint64_t connected_ = 0;  // how often
  std::optional<net::SurfaceNews> news_;
  std::jthread thread_;  // last: it uses what stands above
};

}  // namespace saccade::session
