#pragma once

#include "server/anchors/anchor_place.hpp"
#include "server/anchors/layer_probe.hpp"

namespace saccade {

/// How far off the nearer of two surfaces may be as the one that was meant [m]: whoever clicks an
/// outline mostly means the thing whose outline it is, but what is behind it has its share.
double OutlineSigma(const DepthLayers& layers);

/// Looks again at what was clicked, now that it has been seen from elsewhere: whether the click is
/// on an outline, and if not how far the surface is. Until that is known, but not longer than the
/// frames last. True if it took time (some milliseconds): one a frame is enough.
bool LookAgain(const FrameLookup& frames, const MapSnapshot& newest, AnchorPlace& place);

}  // namespace saccade
