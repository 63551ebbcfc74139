#pragma once

#include <Eigen/Dense>
#include <optional>

#include "server/anchors/frame_ring.hpp"
#include "server/anchors/layer_probe.hpp"
#include "server/anchors/local_surface.hpp"

namespace saccade {

/// What is known of the surface that a click lies on.
enum class ClickSurface { kUnknown, kOne, kOutline };

/// Why the depth of a click may be another than the one that was taken. It widens what a mark
/// claims and moves nothing: where a click lands is decided by `click`, where a mark goes by
/// `anchor_place`.
///
/// Features and patches know well how far away what they show is, and nothing of whether it is what
/// was clicked: a mug before a wall has no feature of its own, a patch on an outline shows both
/// sides of it.
struct DepthDoubt {
  ClickSurface surface = ClickSurface::kUnknown;
  double clutter_sigma_m = 0;  // what was clicked may stand out from what is known around it
  double relief_sigma_m = 0;   // the same within a patch at the very pixel
  double floor_sigma_m = 0;    // nobody knows better
  double outline_sigma_m = 0;  // between what is in front and what is behind
  /// Range of the surface that most of the picture there shows, and how well it does [m]; 0: none.
  double seen_m = 0, seen_sigma_m = 0;

  /// Sigma along the clicked ray [m] of a mark that is `range_m` away on it. `measured`: a patch at
  /// the very pixel has told the depth.
  double Sigma(double range_m, bool measured) const;
};

/// The picture's own word on the depth of a click. Where it contradicts the neighbours it wins:
/// they may lie on what is behind; `depth` changes. Returns what remains open.
DepthDoubt AskThePicture(const PastFrame& past, const Eigen::Vector2d& pixel, FrameId newest,
                         const FrameLookup& frames, const PoseTrail* trail, SurfaceDepth& depth);

/// Where was clicked, for looking again once that has been seen from elsewhere.
struct ClickLook {
  FrameId frame_id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double range_m = 0;  // where it was placed: where to look first
  double next_s = 0;   // after the click
};

/// Looks again, `age_s` after the click, whether the click is on an outline: until that is known,
/// but not longer than frames are kept. True if it took time (some milliseconds): one such look a
/// frame is enough.
bool LookAgain(const FrameLookup& frames, const PoseTrail* trail, const MapSnapshot& newest,
               double age_s, std::optional<ClickLook>& look, DepthDoubt& doubt);

}  // namespace saccade
