#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace saccade {

/// A basin of a grey picture that is flooded from below, as it was when it met another as large.
struct Puddle {
  cv::Point bottom;        // its darkest pixel
  int level = 0;           // grey value there
  int depth = 0;           // from there to where it overflows
  int area_px = 0;         // when it does
  double compactness = 0;  // 1 for any filled parallelogram, less for what is frayed or hollow
};

struct PuddleOptions {
  int least_depth = 25;    // grey levels: a shallower one is noise, or too faint to read
  int least_area_px = 40;  // of a square of 20 px at 60 deg, half
  int most = 300;          // the best ones
};

/// The basins of `grey` (CV_8UC1), the deepest and most compact first: watershed by flooding
/// (Koller et al., VRST 1997, section 2.1), with what they call depth. One that holds others is
/// there too.
std::vector<Puddle> FindPuddles(const cv::Mat& grey, const PuddleOptions& options = {});

}  // namespace saccade
