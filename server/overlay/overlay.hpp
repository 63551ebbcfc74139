#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/pipeline/pointers.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What `video_view` augmented shows.
struct OverlayOptions {
  bool features = true;
  bool annotations = true;
  bool edge_arrows = true;  // to annotations outside the view
  bool world_axes = true;
  bool status_line = true;                        // one line of text for the wearer
  std::optional<FeatureId> fixated_feature;       // green
  std::optional<std::string> fixated_annotation;  // green
  std::shared_ptr<const PointerList> pointers;    // null: none
  /// Decoded, BGR; empty: not yet. Null: outlines alone are drawn.
  std::function<cv::Mat(const PicturePtr&)> picture;
  /// The scene from there as SceneView draws it, or empty; lies under every mark. Null: none.
  std::function<cv::Mat(const CameraModel&, const Rigid3& world_from_camera)> scene;
};

/// The picture of `frame` with everything that `snapshot` (of the same frame) and `annotations`
/// (resolved with that snapshot) say, through the lens of that frame. CV_8UC3 BGR, size of the
/// frame. Never fails: what cannot be projected is left out. Any thread; each keeps the texts that
/// it drew (TextPainter).
cv::Mat Augment(const Frame& frame, const MapSnapshot& snapshot,
                const std::vector<Annotation>& annotations, const OverlayOptions& options);

/// The line of text for the wearer: state of tracking and what to do about it.
std::string StatusLine(const MapSnapshot& snapshot);

}  // namespace saccade
