#include "server/anchors/frame_ring.hpp"

#include <absl/status/status.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace saccade {
namespace {

constexpr std::size_t kMostWaiting = 6;  // frames; at 30 a second the packer is a frame behind

std::size_t Bytes(const cv::Mat& image) { return image.total() * image.elemSize(); }
// A map of a whole room is a third of a picture.
std::size_t Bytes(const PastFrame& past) {
  const std::size_t features = past.snapshot ? past.snapshot->features.size() : 0;
  return Bytes(past.frame->grey) + Bytes(past.frame->color) + features * sizeof(FeatureSnapshot);
}

}  // namespace

PastFrame FrameRing::Packed::Unpack(Want want) const {
  if (want == Want::kPose) return {std::make_shared<const Frame>(frame.head), snapshot.Unpack()};
  return {saccade::Unpack(frame, want == Want::kAll), snapshot.Unpack()};
}

std::shared_ptr<const FrameRing::Packed> FrameRing::PackOne(const PastFrame& past,
                                                            const PackedSnapshot* before) {
  thread_local FramePacker packer;
  static const MapSnapshot kNothing;
  try {
    return std::make_shared<const Packed>(
        Packed{packer.Pack(*past.frame),
               PackedSnapshot(past.snapshot ? *past.snapshot : kNothing, before)});
  } catch (const std::exception&) {  // no memory
    return nullptr;
  }
}

void FrameRing::Push(PastFrame past) {
  std::unique_lock lock(mutex_);
  if (!packer_.joinable()) {
    packer_ = std::jthread([this](const std::stop_token& stop) { PackOld(stop); });
  }
  changed_.wait(lock,
                [this] { return frames_.size() < packed_ + options_.max_unpacked + kMostWaiting; });
  if (!frames_.empty() && past.frame->id <= frames_.back().id) {
    frames_.clear();
    held_.clear();
    bytes_ = packed_ = colored_from_ = 0;
  }
  Entry entry{past.frame->id, past.frame->capture_time_ns, std::move(past), nullptr, 0, false};
  entry.bytes = Bytes(entry.whole);
  bytes_ += entry.bytes;
  frames_.push_back(std::move(entry));
  Trim();
  changed_.notify_all();
}

void FrameRing::DropColor(Entry& entry) {
  bytes_ -= entry.bytes;
  if (entry.packed) {
    auto grey = std::make_shared<Packed>(*entry.packed);
    grey->frame.cr = grey->frame.cb = PackedPlane();
    entry.bytes = grey->frame.bytes() + grey->snapshot.bytes();
    entry.packed = std::move(grey);
  } else {
    auto grey = std::make_shared<Frame>(*entry.whole.frame);
    grey->color.release();
    entry.whole.frame = std::move(grey);
    entry.bytes = Bytes(entry.whole);
  }
  bytes_ += entry.bytes;
}

void FrameRing::Trim() {
  const auto pop = [this] {
    bytes_ -= frames_.front().bytes;
    frames_.pop_front();
    if (colored_from_ > 0) --colored_from_;
    if (packed_ > 0) --packed_;
  };
  const auto limit_ns = static_cast<Timestamp>(options_.duration_s * 1e9);
  const Timestamp newest_ns = frames_.back().time_ns;
  // Either way: after a clock was set back, what came before is not young from now on.
  while (std::abs(newest_ns - frames_.front().time_ns) > limit_ns) pop();
  while (bytes_ > options_.max_bytes && colored_from_ + 1 < frames_.size()) {
    DropColor(frames_[colored_from_++]);
  }
  while (bytes_ > options_.max_bytes && frames_.size() > 1) pop();
}

void FrameRing::PackOld(const std::stop_token& stop) {
  std::shared_ptr<const Packed> before;
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return MayPack(); })) {
    const PastFrame past = frames_[packed_].whole;
    lock.unlock();
    std::shared_ptr<const Packed> packed = PackOne(past, before ? &before->snapshot : nullptr);
    lock.lock();
    // Meanwhile it may have gone, or lost its colour: then it is packed again.
    if (packed_ >= frames_.size() || frames_[packed_].whole.frame != past.frame) continue;
    Entry& entry = frames_[packed_++];
    if (packed) {  // else it stays as it is
      bytes_ -= entry.bytes;
      entry.bytes = packed->frame.bytes() + packed->snapshot.bytes();
      bytes_ += entry.bytes;
      entry.packed = before = std::move(packed);
      entry.whole = PastFrame();
    }
    changed_.notify_all();
  }
}

absl::StatusOr<FrameRing::Entry> FrameRing::Locate(FrameId id) const {
  const std::lock_guard lock(mutex_);
  if (frames_.empty()) return absl::NotFoundError("no frame has been captured yet; wait for video");
  for (const std::shared_ptr<const Packed>& held : held_) {
    if (held->frame.head.id == id) return Entry{id, 0, {}, held, 0, true};
  }
  const FrameId first = frames_.front().id;
  const FrameId last = frames_.back().id;
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
  const auto found =
      std::lower_bound(frames_.begin(), frames_.end(), id,
                       [](const Entry& entry, FrameId wanted) { return entry.id < wanted; });
  if (found->id != id) {
    return absl::NotFoundError(absl::StrFormat(
        "frame %d was dropped before it was tracked; use the id of a picture you were sent", id));
  }
  Entry entry = *found;
  entry.old = static_cast<std::size_t>(frames_.end() - found) > options_.max_unpacked;
  return entry;
}

absl::StatusOr<PastFrame> FrameRing::Find(FrameId id, Want want) const {
  const absl::StatusOr<Entry> entry = Locate(id);
  if (!entry.ok()) return entry.status();
  if (!entry->packed && (!entry->old || want == Want::kPose)) return entry->whole;
  try {
    // What the packer has not come to yet is answered as it will be: nothing depends on timing.
    const auto packed = entry->packed ? entry->packed : PackOne(entry->whole, nullptr);
    return packed ? packed->Unpack(want) : entry->whole;
  } catch (const std::exception&) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("frame %d cannot be unpacked: no memory; try again", id));
  }
}

absl::StatusOr<PastFrame> FrameRing::Newest() const {
  const std::lock_guard lock(mutex_);
  if (frames_.empty()) return absl::NotFoundError("no frame has been captured yet; wait for video");
  return frames_.back().whole;
}

void FrameRing::Hold(const PastFrame& past) {
  const std::shared_ptr<const Packed> packed = PackOne(past, nullptr);
  if (packed == nullptr) return;
  const std::lock_guard lock(mutex_);
  std::erase_if(held_, [&](const auto& kept) { return kept->frame.head.id == past.frame->id; });
  held_.push_back(packed);
  if (held_.size() > options_.max_held) held_.pop_front();
}

void FrameRing::WaitUntilPacked() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !MayPack(); });
}

std::size_t FrameRing::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace saccade
