#pragma once

#include <Eigen/Dense>

namespace saccade {

/// How light falls on things, to first order: a surface with the unit normal n is as bright as
/// `level` * (1 + toward.dot(n)) times its colour.
struct SceneLight {
  double level = 1.0;                                         // of the mean over all directions
  Eigen::Vector3d toward_in_world = Eigen::Vector3d::Zero();  // length: 0 even, 1 one lamp
  /// 0: nothing is known, all of it is a guess; 1: measured.
  double confidence = 0.0;
};

}  // namespace saccade
