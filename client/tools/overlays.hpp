#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/tools/things.hpp"

/// What is laid over a room to explain it, as web/src/ui/thing_overlays.ts has it.
namespace saccade::tools {

enum class OverlayKind { kGrid, kRoute, kPipe, kWire, kPointer };

struct OverlayWords {
  OverlayKind kind;
  const char *name, *words;  // "grid", "lays a grid on a floor: 1 point"
};
std::span<const OverlayWords> Overlays();

/// A thing that is not there yet (without its model's id), and the GLB file of that model.
struct Overlay {
  SceneObject thing;
  std::string file;
};

/// Where a click landed, and out of what.
struct OverlayPoint {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();     // [m]
  Eigen::Vector3d normal_in_world = -Eigen::Vector3d::UnitY();  // unit, towards who looks
  std::optional<ThingHit> hit{};                                // a known surface
};

/// Overlays by clicks: grid and arrow by one, routes, pipes and wires by as many as they have
/// bends.
class Overlaying {
 public:
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  void Clear();
  /// What the next click is, in words.
  std::string Hint(OverlayKind kind) const;
  /// Nothing: more points are wanted. Errors in words.
  absl::StatusOr<std::optional<Overlay>> Click(OverlayKind kind, const OverlayPoint& point,
                                               const Scene& scene);
  /// What was clicked so far. FailedPrecondition, in words: that is nothing yet.
  absl::StatusOr<Overlay> Finish(OverlayKind kind, const Scene& scene);

 private:
  std::vector<Eigen::Vector3d> points_, normals_;
};

}  // namespace saccade::tools
