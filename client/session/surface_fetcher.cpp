#include "client/session/surface_fetcher.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

namespace saccade::session {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kPieceBytes = 65'536;
constexpr milliseconds kAfterError(2'000), kShortestPause(20);

}  // namespace

SurfaceFetcher::SurfaceFetcher(std::function<void(net::SurfacePiece)> took)
    : took_(std::move(took)), thread_([this](std::stop_token stop) { Run(stop); }) {}

void SurfaceFetcher::Connect(const net::ConnectionOptions& options) {
  const std::lock_guard lock(mutex_);
  options_ = options;
  ++connected_;
  news_.reset();
}

void SurfaceFetcher::Tell(const net::SurfaceNews& news) {
  {
    const std::lock_guard lock(mutex_);
    news_ = news;
  }
  changed_.notify_all();
}

void SurfaceFetcher::Run(std::stop_token stop) {
  std::unique_ptr<net::Connection> connection;
  std::uint64_t made_for = 0, edition = 0, version = 0;
  while (!stop.stop_requested()) {
    net::ConnectionOptions options;
    {
      std::unique_lock lock(mutex_);
      const auto behind = [&] {
        return options_ && news_ && (news_->edition != edition || news_->version > version);
      };
      if (!changed_.wait(lock, stop, behind)) return;
      options = *options_;
      if (made_for != connected_) connection.reset();
      made_for = connected_;
    }
    const Clock::time_point begin = Clock::now();
    absl::StatusOr<net::SurfacePiece> piece = absl::UnavailableError("");
    if (connection == nullptr) {
      if (auto made = net::Connection::Create(options); made.ok()) connection = *std::move(made);
    }
    if (connection != nullptr) piece = connection->GetSurface(edition, version, kPieceBytes);
    milliseconds pause = kAfterError;
    if (piece.ok()) {
      edition = piece->edition;
      version = piece->version;
      pause =
          std::max(kShortestPause, std::chrono::duration_cast<milliseconds>(Clock::now() - begin));
      took_(*std::move(piece));
    }
    std::unique_lock lock(mutex_);
    if (piece.ok() && edition == 0) news_.reset();  // this server makes none
    changed_.wait_for(lock, stop, pause, [] { return false; });
  }
}

}  // namespace saccade::session
