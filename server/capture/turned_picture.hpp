#pragma once

#include <opencv2/core.hpp>

#include "server/capture/image_file.hpp"
#include "server/capture/uri_query.hpp"

namespace saccade {

/// How a camera is built in.
struct Turn {
  int clockwise_deg = 0;  // 0, 90, 180 or 270: what the picture is turned by to stand upright
  bool mirror = false;    // afterwards left and right are swapped

  bool swaps_sides() const { return clockwise_deg % 180 != 0; }
};

/// rotate=0|90|180|270 and mirror=1 of a URI.
Turn ReadTurn(UriQuery& query);

/// `picture` upright. The lens is that of the upright picture.
DecodedPicture Turned(DecodedPicture picture, const Turn& turn);

}  // namespace saccade
