#pragma once

#include <Eigen/Dense>
#include <span>

#include "shared/scene/scene_light.hpp"

namespace saccade {

/// A patch of white paper in one picture: what a square is printed on.
struct PaperSeen {
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::UnitZ();  // unit, out of the paper
  double level = 0;                                            // grey levels, 0 to 255
};

/// Where the light comes from, by how bright the same white paper is that hangs and lies in
/// different ways: level (1 + n . v), v by least squares over the pictures, drawn to zero where
/// the papers do not tell. A picture's exposure drops out: papers are compared within it. Papers
/// that all face one way tell nothing. One thread.
class LightFit {
 public:
  /// Those of one picture.
  void Add(std::span<const PaperSeen> papers);
  /// Of confidence 0 without evidence.
  SceneLight light() const;

 private:
  double weight_ = 0;  // pictures with papers that face different ways
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right_by_light_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
  double level_ = 0, level_weight_ = 0;
  Eigen::Vector3d facing_ = Eigen::Vector3d::Zero();  // mean of the papers'
};

}  // namespace saccade
