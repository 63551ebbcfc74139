#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/eval/frame_range.hpp"

namespace saccade {

/// One picture that stands still, as a stuck camera shows it.
struct Freeze {
  FrameId frame = 0;
  Timestamp duration_ns = 0;
};

/// What is done to a recording before the tracker sees it.
struct Alterations {
  std::vector<FrameRange> drop = {};  // frames left out, by their position in the recording
  std::uint64_t every = 1;            // of what remains only every Nth, from the first on
  std::optional<Freeze> freeze = std::nullopt;

  bool none() const { return drop.empty() && every == 1 && !freeze; }
};

/// "K:SECONDS", such as 300:2. InvalidArgument: anything else, or not above 0 s and up to an hour.
absl::StatusOr<Freeze> ParseFreeze(absl::string_view text);

/// `source` with `alterations`. Frames keep their ids and time stamps, and the camera its frame
/// rate: what is missing was lost on the way. While the freeze lasts, frames come with their own
/// stamps and the picture (and encoder angles) of frame `freeze.frame`.
std::unique_ptr<FrameSource> Altered(std::unique_ptr<FrameSource> source, Alterations alterations);

}  // namespace saccade
