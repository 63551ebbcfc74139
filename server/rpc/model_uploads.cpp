#include "server/rpc/model_uploads.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

namespace saccade {
namespace {

constexpr Timestamp kForgotten_ns = 60'000'000'000;

}  // namespace

absl::StatusOr<ModelUploads::Progress> ModelUploads::Take(const Piece& piece, Timestamp now_ns) {
  if (piece.total == 0 || piece.total > kMostBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("total_bytes: ", piece.total, "; give 1 to ", kMostBytes));
  }
  if (piece.data.empty() || piece.data.size() > kMostPiece) {
    return absl::InvalidArgumentError(
        absl::StrCat("data: ", piece.data.size(), " bytes; give 1 to ", kMostPiece));
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(by_participant_, [now_ns](const auto& one) {
    return now_ns - one.second.touched_ns > kForgotten_ns;
  });
  if (piece.offset == 0) {
    if (by_participant_.size() >= kMost && !by_participant_.contains(piece.participant_id)) {
      return absl::ResourceExhaustedError("upload_id: others upload models; try again in a minute");
    }
    by_participant_[piece.participant_id] = {piece.upload_id, {}, piece.total, now_ns};
  }
  const auto found = by_participant_.find(piece.participant_id);
  if (found == by_participant_.end() || found->second.upload_id != piece.upload_id ||
      found->second.total != piece.total || found->second.bytes.size() != piece.offset ||
      piece.data.size() > piece.total - piece.offset) {
    return absl::FailedPreconditionError(absl::StrCat(
        "offset_bytes: ", piece.offset, " is not what comes next; begin again from 0"));
  }
  Upload& upload = found->second;
  upload.bytes += piece.data;
  upload.touched_ns = now_ns;
  Progress progress{upload.bytes.size(), std::nullopt};
  if (progress.received < upload.total) return progress;
  progress.whole = std::move(upload.bytes);
  by_participant_.erase(found);
  return progress;
}

}  // namespace saccade
