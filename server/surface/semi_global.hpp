#pragma once

#include <cstdint>
#include <vector>

#include "server/surface/plane_sweep.hpp"

namespace saccade {

struct SmoothnessOptions {
  int small_step = 8;         // cost of one plane more or less from pixel to pixel
  int large_step = 60;        // of any other step, where the picture is even...
  int least_large_step = 24;  // ...and where it is not
  float edge = 12.0f;         // difference of pixels that halves the former [grey levels]
};

/// Costs summed along eight directions, each path paying for steps in depth: semi-global matching,
/// Hirschmueller, "Stereo processing by semiglobal matching and mutual information", PAMI 30(2),
/// 2008. Laid out as CostVolume::costs; 8 times as large at most. 10 ms for 160x120 and 80 planes.
std::vector<std::uint16_t> SumSemiGlobally(const CostVolume& volume, const cv::Mat& grey,
                                           const SmoothnessOptions& options);

}  // namespace saccade
