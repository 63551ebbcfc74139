#pragma once

#include <Eigen/Dense>

#include "shared/geometry/rigid3.hpp"

namespace saccade::tools {

/// Where the eye above the map is, and where it is going. Moves by hand are immediate, others are
/// eased in under 250 ms. World y points down. One thread.
class Orbit {
 public:
  /// Moves towards the goal; true while there is still some way to go.
  bool Step(double elapsed_ms);
  /// Turns by hand [rad]; pitch above 0 looks down.
  void Rotate(double yaw_rad, double pitch_rad);
  /// Shifts by hand, in fractions of the distance, right and down as seen.
  void Pan(double right, double down);
  /// Closer (below 1) or farther, eased. What is at (`right`, `down`) from the middle, in fractions
  /// of the distance, stays where it is on the screen.
  void Zoom(double factor, double right = 0, double down = 0);
  /// Eases to look at a sphere [m].
  void LookAt(const Eigen::Vector3d& target, double radius_m);
  /// Eases to a target, keeping direction and distance.
  void Follow(const Eigen::Vector3d& target) { goal_.target = target; }
  /// Eases to look straight down.
  void FromTop();

  double distance_m() const { return now_.distance; }
  /// Of the eye: x right, y down, z forward.
  Rigid3 world_from_camera() const;

 private:
  struct Place {
    Eigen::Vector3d target{0, 0, 0.8};  // in world [m]
    double yaw = 0.5;                   // about world y [rad]; 0 looks along +z
    double pitch = 0.55;
    double distance = 2;  // [m]
  };
  static Eigen::Matrix3d Basis(const Place& place);  // columns x, y, z in world
  void Jump(const Place& place) { now_ = goal_ = place; }

  Place now_, goal_;
};

}  // namespace saccade::tools
