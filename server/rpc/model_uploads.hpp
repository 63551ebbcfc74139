#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Models on their way here, in pieces. Little is held for those who do not go on: one upload of a
/// participant, kMost in all, a minute each. Thread safe.
class ModelUploads {
 public:
  static constexpr std::size_t kMost = 4, kMostBytes = std::size_t{32} << 20;
  static constexpr std::size_t kMostPiece = 200 * 1024;

  struct Piece {
    std::string participant_id, upload_id, name;
    std::size_t total = 0, offset = 0;  // [bytes]
    const std::string& data;
  };
  struct Progress {
    std::size_t received = 0;
    std::optional<std::string> whole;  // once all is there; it is then forgotten here
  };

  /// InvalidArgument: sizes; FailedPrecondition: not the piece that is next (begin anew);
  /// ResourceExhausted: too many uploads.
  absl::StatusOr<Progress> Take(const Piece& piece, Timestamp now_ns);

 private:
  struct Upload {
    std::string upload_id, bytes;
    std::size_t total = 0;
    Timestamp touched_ns = 0;
  };
  std::mutex mutex_;
  std::map<std::string, Upload> by_participant_;
};

}  // namespace saccade
