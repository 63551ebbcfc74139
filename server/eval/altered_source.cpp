#include "server/eval/altered_source.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

namespace saccade {
namespace {

constexpr double kMaxFreeze_s = 3600;

bool Contains(const FrameRange& range, FrameId id) {
  return id >= range.first && (!range.end || id < *range.end);
}

class AlteredSource final : public FrameSource {
 public:
  AlteredSource(std::unique_ptr<FrameSource> source, Alterations alterations)
      : source_(std::move(source)), alterations_(std::move(alterations)) {}

  const SourceInfo& info() const override { return source_->info(); }
  std::uint64_t bad_frames() const override { return source_->bad_frames(); }
  void Stop() override { source_->Stop(); }

  absl::StatusOr<std::optional<Frame>> Next() override {
    while (true) {
      absl::StatusOr<std::optional<Frame>> next = source_->Next();
      if (!next.ok() || !*next) return next;
      Frame& frame = **next;
      FreezeOrKeep(frame);
      const bool dropped =
          std::any_of(alterations_.drop.begin(), alterations_.drop.end(),
                      [&](const FrameRange& range) { return Contains(range, frame.id); });
      if (dropped || remaining_++ % alterations_.every != 0) continue;
      return next;
    }
  }

 private:
  void FreezeOrKeep(Frame& frame) {
    if (!alterations_.freeze) return;
    if (frame.id == alterations_.freeze->frame) frozen_ = frame;
    if (!frozen_) return;
    if (frame.capture_time_ns - frozen_->capture_time_ns > alterations_.freeze->duration_ns) {
      frozen_.reset();
      return;
    }
    frame.grey = frozen_->grey;
    frame.color = frozen_->color;
    frame.mount = frozen_->mount;
  }

  const std::unique_ptr<FrameSource> source_;
  const Alterations alterations_;
  std::optional<Frame> frozen_;  // while its picture stands
  std::uint64_t remaining_ = 0;  // frames that were not dropped
};

}  // namespace

absl::StatusOr<Freeze> ParseFreeze(absl::string_view text) {
  const std::size_t colon = text.find(':');
  Freeze freeze;
  double seconds = 0;
  if (colon == absl::string_view::npos || !absl::SimpleAtoi(text.substr(0, colon), &freeze.frame) ||
      !absl::SimpleAtod(text.substr(colon + 1), &seconds) ||
      !(seconds > 0 && seconds <= kMaxFreeze_s)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--freeze '", text,
                     "' is not K:SECONDS, a frame from zero and above 0 to 3600 s, such as 300:2"));
  }
  freeze.duration_ns = static_cast<Timestamp>(1e9 * seconds);
  return freeze;
}

std::unique_ptr<FrameSource> Altered(std::unique_ptr<FrameSource> source, Alterations alterations) {
  if (alterations.none()) return source;
  return std::make_unique<AlteredSource>(std::move(source), std::move(alterations));
}

}  // namespace saccade
