#pragma once

#include "server/filter/filter_state.hpp"
#include "server/tracker/frame_matcher.hpp"

namespace saccade {

struct SettlingOptions {
  int known_features = 12;  // with known depth, before poses are published
  int longest_frames = 15;  // under pure rotation depth never settles
};

/// Whether a map without target has settled, `frames` after it began without evidence
/// (`start=false`): enough of what is in view has a known depth, or it waited long enough.
bool HasSettled(const FrameMatches& matches, const FilterState& filter, std::int64_t frames,
                const SettlingOptions& options);

}  // namespace saccade
