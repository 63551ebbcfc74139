#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/sim/surface.hpp"

namespace saccade {

/// Where a ray meets the scene.
struct RayHit {
  float distance = 0;  // along the (unit) direction [m]
  int patch = -1;      // in RoomScene::patches
  float s = 0, t = 0;  // position in the patch: 0 .. 1 to the right and down
  bool front = true;   // the side that shows was hit
};

/// Casts rays into a scene's triangles through a bounding volume hierarchy. Immutable: any thread.
class RayCaster {
 public:
  explicit RayCaster(const RoomScene& scene);

  /// First surface along `direction` (unit) within `max_distance`, whichever side it shows.
  std::optional<RayHit> Closest(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                float max_distance = 1e9f) const;
  /// True if anything that casts a shadow lies between.
  bool Blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
               float max_distance) const;

  std::size_t triangle_count() const { return triangles_.size(); }

 private:
  struct Triangle {
    Eigen::Vector3f a, edge1, edge2;
    Eigen::Vector2f st_a, st1, st2;  // patch position at a, and along the edges
    int patch = 0;
    bool casts_shadow = true;
  };
  struct Node {
    Eigen::Array3f low, high;
    std::uint32_t first = 0;  // of the triangles (leaf) or of the two children
    std::uint32_t count = 0;  // 0: inner node
  };

  struct Bounds {
    Eigen::Array3f low = Eigen::Array3f::Constant(1e9f), high = Eigen::Array3f::Constant(-1e9f);
    void Add(const Eigen::Array3f& point) {
      low = low.min(point);
      high = high.max(point);
    }
    void Add(const Bounds& other) {
      low = low.min(other.low);
      high = high.max(other.high);
    }
    Eigen::Array3f Centre() const { return 0.5f * (low + high); }
    float HalfArea() const {
      const Eigen::Array3f size = (high - low).max(0.0f);
      return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    }
  };
  struct Split {
    int axis = -1;  // < 0: none is worth it
    float position = 0;
  };

  static Bounds BoundsOf(const Triangle& t);
  Split BestSplit(std::uint32_t first, std::uint32_t count, const Bounds& centres) const;
  void Build(std::uint32_t node, std::uint32_t first, std::uint32_t count);
  template <bool kAny>
  std::optional<RayHit> Trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                              float max_distance) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace saccade
