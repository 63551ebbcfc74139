#pragma once

#include <Eigen/Dense>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace saccade {

/// A picture that surfaces are painted with. Row 0 has texture coordinate v = 0.
struct SurfaceTexture {
  cv::Mat bgr;  // CV_8UC3
  bool repeat = true;
  Eigen::Vector3f mean_rgb_linear = Eigen::Vector3f::Zero();  // reflectance, for bounced light
};

/// A painted grid of (columns + 1) x (rows + 1) vertices in world, seen from the side its normals
/// point to. Grid column i, row j is vertex j * (columns + 1) + i; i runs to the right and j down
/// when looked at from outside.
struct SurfacePatch {
  int columns = 1, rows = 1;
  std::vector<Eigen::Vector3f> positions;  // [m] in world
  std::vector<Eigen::Vector3f> normals;    // unit
  std::vector<Eigen::Vector2f> uv;         // in the texture
  int texture = 0;
  int light_columns = 2, light_rows = 2;  // samples of baked light, corners included
  int light_x = 0, light_y = 0;           // where they lie in RoomScene::light
  float glow = 0.0f;                      // > 0: shines by itself; light falling on it is ignored
  bool casts_shadow = true;
};

/// A point that truth follows, on a visible, textured surface.
struct NamedPoint {
  std::string name;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
};

/// The whole place, ready to draw and to cast rays into.
struct RoomScene {
  std::vector<SurfaceTexture> textures;
  std::vector<SurfacePatch> patches;
  std::vector<NamedPoint> objects;
  /// CV_8UC3 BGR atlas; the picture is texture * light * kLightScale, both gamma encoded (2.2).
  cv::Mat light;
};
inline constexpr float kLightScale = 1.5f;

}  // namespace saccade
