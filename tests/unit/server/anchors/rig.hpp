#pragma once

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
  explicit Rig(const SyntheticMap::Options& options = {}, SeedFeatureFunction seed = nullptr)
      : map(options),
        manager(
            RigOptions(), [this](FrameId id) { return ring.Find(id); }, std::move(seed)) {}

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
