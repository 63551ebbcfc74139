#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "server/anchors/anchor_manager.hpp"
#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::testing {

inline AnchorOptions RigOptions() {
  AnchorOptions options;
  options.world_key = "chessboard 9x6 0.04 m";
  return options;
}

/// A room, a ring of frames and the manager under test.
struct Rig {
  explicit Rig(const SyntheticMap::Options& options = {}, SeedFeatureFunction seed = nullptr,
               AnchorOptions anchors = RigOptions())
      : map(options),
        manager(
            std::move(anchors), [this](FrameId id) { return ring.Find(id); }, std::move(seed)) {}

  std::shared_ptr<const MapSnapshot> Show(const Rigid3& true_pose) {
    std::shared_ptr<const MapSnapshot> snapshot = map.Snapshot(true_pose);
    map.PushTo(ring);
    manager.Resolve(snapshot, *map.camera());
    return snapshot;
  }
  absl::StatusOr<AnnotationEdit> Click(FrameId frame, const Eigen::Vector2d& pixel) {
    AnnotationDraft draft;
    draft.target = PixelTarget{frame, pixel};
    return manager.Create(draft, "expert");
  }
  absl::StatusOr<AnnotationEdit> PlaceAt(const Eigen::Vector3d& point, const std::string& session) {
    AnnotationDraft draft;
    draft.target = PointTarget{point};
    return manager.Create(draft, session);
  }
  /// A wavy stroke of so many points about the middle of the newest frame.
  absl::StatusOr<AnnotationEdit> Draw(std::size_t points, const std::string& session) {
    AnnotationDraft draft;
    draft.shape = AnnotationShape::kInk;
    draft.target = PixelTarget{map.next_frame - 1, Eigen::Vector2d(320, 240)};
    for (std::size_t i = 0; i < points; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(points);
      draft.ink_px.emplace_back(300 + 40 * t, 240 + 10 * std::sin(20 * t));
    }
    return manager.Create(draft, session);
  }
  const Annotation& Only() {
    held = manager.Latest();
    return held->front();
  }
  /// Point of the true room that the pixel shows.
  Eigen::Vector3d Truth(const Rigid3& true_pose, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d ray = true_pose.rotation * *map.camera()->Unproject(pixel);
    return true_pose.translation + *map.Raycast(true_pose.translation, ray) * ray;
  }

  SyntheticMap map;
  FrameRing ring;
  AnchorManager manager;
  std::shared_ptr<const std::vector<Annotation>> held;
};

}  // namespace saccade::testing
