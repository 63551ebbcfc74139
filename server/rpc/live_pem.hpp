#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace saccade {

/// A text that gRPC reads as a file, again and again, and that is on no disk: gRPC 1.51 takes a new
/// certificate while it serves only from files, and a private key belongs in none that is not its
/// owner's choice. Changed at once or not at all. Thread safe.
class LivePem {
 public:
  /// Unavailable: the system gives no memory for it.
  static absl::StatusOr<std::unique_ptr<LivePem>> Make(const std::string& text);
  ~LivePem();
  LivePem(const LivePem&) = delete;
  LivePem& operator=(const LivePem&) = delete;

  std::string path() const;
  absl::Status Set(const std::string& text);

 private:
  explicit LivePem(int fd) : fd_(fd) {}
  const int fd_;
};

}  // namespace saccade
