#pragma once

#include <optional>
#include <vector>

#include "server/eval/score.hpp"

namespace saccade {

inline constexpr Timestamp kScaleWindow_ns = 3'000'000'000;
inline constexpr double kScaleWindowPath_m = 0.2;  // less of a true path holds no scale

/// How the scale of published poses wanders.
struct ScaleWindows {
  double min = 1, max = 1;  // Sim3 scale of a window over that of the whole
  std::size_t windows = 0;
};

/// Every window of three seconds that begins at a pose of `tracked` (as published, in order of
/// time) and lies within the run: its Sim3 scale (truth = scale * estimate, as `scale` of the
/// report) over the scale of all poses. Above 1: the map is too small there. Windows with less than
/// 0.2 m of true path or fewer than ten poses are left out; nothing if none remains. A pose that is
/// missing shortens the path by what it would have bent it.
std::optional<ScaleWindows> ScaleOfWindows(const std::vector<PosePair>& tracked);

}  // namespace saccade
