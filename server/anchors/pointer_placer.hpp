#pragma once

#include <absl/status/statusor.h>
#include <absl/types/span.h>

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "server/anchors/anchor_place.hpp"
#include "server/anchors/frame_ring.hpp"
#include "server/pipeline/pointers.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Where pointers point: targets to points in the newest map, from its snapshot and without a word
/// to the tracker. A pixel is resolved as a click is, by its frame's pose, but by features alone: a
/// pointer is gone in a second. Any thread; 0.1 ms a point in a map of 1000 landmarks, and as
/// many looks at the surfaces as a click takes.
class PointerPlacer {
 public:
  PointerPlacer(FrameLookup frames, AnchorOptions options)
      : frames_(std::move(frames)), options_(std::move(options)) {}

  /// The newest map.
  void OnSnapshot(std::shared_ptr<const MapSnapshot> snapshot,
                  std::shared_ptr<const SurfaceSnapshot> surface = nullptr);

  /// Errors as AnchorManager::Create, naming points[i].
  absl::StatusOr<std::vector<Eigen::Vector3d>> Locate(
      absl::Span<const AnnotationTarget> points) const;
  /// The same of a stroke: what follows its first point lies on the surface that this one found, as
  /// far as it reaches; beside it, at that one's distance. `surface`: of the stroke, filled in by
  /// its first point.
  absl::StatusOr<std::vector<Eigen::Vector3d>> Trace(absl::Span<const AnnotationTarget> points,
                                                     std::optional<StrokeSurface>& surface) const;

 private:
  absl::StatusOr<std::shared_ptr<const MapView>> Newest() const;
  absl::StatusOr<PastFrame> Find(FrameId id) const;

  const FrameLookup frames_;
  const AnchorOptions options_;
  mutable std::mutex mutex_;
  std::shared_ptr<const MapView> newest_;
  mutable std::deque<PastFrame> found_;  // the last few that were asked for
};

}  // namespace saccade
