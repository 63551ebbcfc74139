#pragma once

#include <Eigen/Dense>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/sim/surface.hpp"

namespace saccade {

/// How a face is painted: one texture, of which the face shows the rectangle `origin` .. `origin +
/// size` (texture coordinates), or, if `tile_m` > 0, repeats that are `tile_m` metres wide and
/// high.
struct Paint {
  int texture = 0;
  Eigen::Vector2f origin{0, 0};
  Eigen::Vector2f size{1, 1};
  Eigen::Vector2f tile_m{0, 0};
  float glow = 0.0f;
};

/// The paint of each face of a box.
struct BoxPaint {
  Paint front, back, left, right, top, bottom;
  explicit BoxPaint(const Paint& all)
      : front(all), back(all), left(all), right(all), top(all), bottom(all) {}
};

/// Builds a RoomScene out of simple solids.
///
/// Solids are given in the current local frame, x right, y up, z towards the viewer of a front
/// face, metres. `room` is the outermost local frame: origin in the lower left corner of the desk
/// wall (seen from inside), x along that wall, y up, z into the room.
class RoomBuilder {
 public:
  explicit RoomBuilder(const Eigen::Isometry3d& world_from_room)
      : world_from_room_(world_from_room) {}

  int AddTexture(const cv::Mat& bgr, bool repeat = true);

  /// Local frames nest: what follows is placed at `origin`, turned by `turn_y_rad` about y (to the
  /// left seen from above), then `tilt_x_rad` about x, until Pop().
  void Push(const Eigen::Vector3f& origin, float turn_y_rad = 0, float tilt_x_rad = 0,
            float roll_z_rad = 0);
  void Pop() { frames_.pop_back(); }

  /// A rectangle from its top left corner, as seen from the side that shows.
  void Quad(const Paint& paint, const Eigen::Vector3f& top_left, const Eigen::Vector3f& right,
            const Eigen::Vector3f& down);
  /// A box with its lowest corner (least x, y, z) at `corner`. The bottom is left out unless asked
  /// for.
  void Box(const BoxPaint& paint, const Eigen::Vector3f& corner, const Eigen::Vector3f& size,
           bool with_bottom = false);
  /// An upright cone or tube of `sides` faces, from `base` upwards; the texture goes round once.
  void Tube(const Paint& side, const Eigen::Vector3f& base, float radius_bottom, float radius_top,
            float height, int sides = 20, bool inside = false);
  /// A flat, round lid at height of `centre`, facing up (or down).
  void Disc(const Paint& paint, const Eigen::Vector3f& centre, float radius, int sides = 20,
            bool facing_down = false);

  /// A curved sheet: `shape(s, t)`, s to the right and t down as seen from the side that shows,
  /// both 0 .. 1. `width_m` and `height_m` set how finely its light is sampled.
  void Sheet(const Paint& paint, int columns, int rows,
             const std::function<Eigen::Vector3f(float, float)>& shape, float width_m,
             float height_m);

  /// A point of the current local frame in world [m].
  Eigen::Vector3f ToWorld(const Eigen::Vector3f& point) const { return WorldFromLocal() * point; }

  /// Names a point given in the current local frame.
  void Name(const std::string& name, const Eigen::Vector3f& point);

  /// Metres between samples of baked light from here on.
  void SetLightSpacing(float spacing_m) { light_spacing_m_ = spacing_m; }

  RoomScene Take() { return std::move(scene_); }

 private:
  Eigen::Isometry3f WorldFromLocal() const;
  void AddGrid(const Paint& paint, int columns, int rows,
               const std::vector<Eigen::Vector3f>& local_positions,
               const std::vector<Eigen::Vector3f>& local_normals, float width_m, float height_m);

  Eigen::Isometry3d world_from_room_;
  std::vector<Eigen::Isometry3f> frames_;
  RoomScene scene_;
  float light_spacing_m_ = 0.06f;
};

}  // namespace saccade
