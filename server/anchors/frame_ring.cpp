#include "server/anchors/frame_ring.hpp"

#include <absl/status/status.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

namespace saccade {
namespace {

std::size_t Bytes(const cv::Mat& image) { return image.total() * image.elemSize(); }
// A map of a whole room is a third of a picture.
std::size_t Bytes(const PastFrame& past) {
  const std::size_t features = past.snapshot ? past.snapshot->features.size() : 0;
  return Bytes(past.frame->grey) + Bytes(past.frame->color) + features * sizeof(FeatureSnapshot);
}

}  // namespace

void FrameRing::Push(PastFrame past) {
  const std::lock_guard lock(mutex_);
  if (!frames_.empty() && past.frame->id <= frames_.back().frame->id) {
    frames_.clear();
    held_.clear();
    bytes_ = 0;
    colored_from_ = 0;
  }
  bytes_ += Bytes(past);
  frames_.push_back(std::move(past));
  Trim();
}

void FrameRing::Trim() {
  const auto pop = [this] {
    bytes_ -= Bytes(frames_.front());
    frames_.pop_front();
    if (colored_from_ > 0) --colored_from_;
  };
  const auto limit_ns = static_cast<Timestamp>(options_.duration_s * 1e9);
  const Timestamp newest_ns = frames_.back().frame->capture_time_ns;
  // Either way: after a clock was set back, what came before is not from now on young.
  while (std::abs(newest_ns - frames_.front().frame->capture_time_ns) > limit_ns) pop();
  while (bytes_ > options_.max_bytes && colored_from_ + 1 < frames_.size()) {
    std::shared_ptr<const Frame>& frame = frames_[colored_from_++].frame;
    auto grey_only = std::make_shared<Frame>(*frame);
    bytes_ -= Bytes(grey_only->color);
    grey_only->color.release();
    frame = std::move(grey_only);
  }
  while (bytes_ > options_.max_bytes && frames_.size() > 1) pop();
}

absl::StatusOr<PastFrame> FrameRing::Find(FrameId id) const {
  const std::lock_guard lock(mutex_);
  if (frames_.empty()) return absl::NotFoundError("no frame has been captured yet; wait for video");
  const auto held = std::find_if(held_.begin(), held_.end(),
                                 [id](const PastFrame& past) { return past.frame->id == id; });
  if (held != held_.end()) return *held;
  const FrameId first = frames_.front().frame->id;
  const FrameId last = frames_.back().frame->id;
  if (id < first) {
    return absl::NotFoundError(absl::StrFormat(
        "frame %d is no longer kept: frames are kept for %.0f s and the oldest is %d; click on a "
        "newer picture",
        id, options_.duration_s, first));
  }
  if (id > last) {
    return absl::NotFoundError(absl::StrFormat(
        "frame %d has not been captured: the newest is %d; use the id of a picture you were sent",
        id, last));
  }
  const auto found = std::lower_bound(
      frames_.begin(), frames_.end(), id,
      [](const PastFrame& past, FrameId wanted) { return past.frame->id < wanted; });
  if (found->frame->id != id) {
    return absl::NotFoundError(absl::StrFormat(
        "frame %d was dropped before it was tracked; use the id of a picture you were sent", id));
  }
  return *found;
}

absl::StatusOr<PastFrame> FrameRing::Newest() const {
  const std::lock_guard lock(mutex_);
  if (frames_.empty()) return absl::NotFoundError("no frame has been captured yet; wait for video");
  return frames_.back();
}

void FrameRing::Hold(const PastFrame& past) {
  const std::lock_guard lock(mutex_);
  std::erase_if(held_, [&](const PastFrame& kept) { return kept.frame->id == past.frame->id; });
  held_.push_back(past);
  if (held_.size() > options_.max_held) held_.pop_front();
}

}  // namespace saccade
