#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <variant>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// One known point with the look of its surroundings (target.yaml, type: patches).
struct KnownPatch {
  int id = 0;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  cv::Mat templ;                                             // CV_8UC1, odd square
};
struct PatchTarget {
  std::vector<KnownPatch> points;
};
/// Inner corners of a chessboard in the plane z = 0 of world; corner (i, j) at (i, j, 0) *
/// square_m, i < columns along +x, j < rows along +y. Used in the first 30 frames only.
struct ChessboardTarget {
  int columns = 0;
  int rows = 0;
  double square_m = 0;
  /// Disambiguates the board's half turn: approximate pixels of corner (0,0), of the end of +x and
  /// of the end of +y in frame 0. Absent: the orientation with corner (0,0) up and left is taken.
  std::optional<std::array<Eigen::Vector2d, 3>> hint_px;
};
using Target = std::variant<PatchTarget, ChessboardTarget>;

/// start.yaml: world_from_camera at frame 0 and what is known of the motion.
struct StartPose {
  Rigid3 world_from_camera;
  double position_sigma_m = 0;
  double orientation_sigma_rad = 0;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  // in world
  double velocity_sigma_m_s = 0.1;
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // in camera
  double angular_velocity_sigma_rad_s = 0.1;
};

}  // namespace saccade
