#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/overlay/strokes.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What `video_view` augmented shows.
struct OverlayOptions {
  bool features = true;
  bool annotations = true;
  bool world_axes = true;
  bool status_line = true;                   // one line for the wearer
  bool halo = true;                          // dark halo round light lines, readable in sunlight
  std::optional<FeatureId> fixated_feature;  // green
  std::optional<std::string> fixated_annotation;  // green
  double line_px = 2.0;                           // at 640 px width; scales with the picture
};

/// The picture of `frame` with everything that `snapshot` (of the same frame) and `annotations`
/// (resolved with that snapshot) say, through the lens of that frame. CV_8UC3, size of the frame.
/// Never fails: what cannot be projected is left out. Any thread, no state.
cv::Mat Augment(const Frame& frame, const MapSnapshot& snapshot,
                const std::vector<Annotation>& annotations, const OverlayOptions& options);

}  // namespace saccade
