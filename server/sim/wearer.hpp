#pragma once

#include <cstdint>

#include "server/capture/frame.hpp"
#include "server/sim/sim_options.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// World of the simulator: the frame of the chessboard on the desk wall (x right, y down, z into
/// the wall, metres). Room: origin in the desk wall's lower left corner, x along it, y up, z into
/// the room.
Rigid3 WorldFromRoom();

/// How a body moves: a smooth path of the mount base at the shoulder, the same for the same seed,
/// defined for every time >= 0. For the first second it faces the chessboard almost at rest.
class Wearer {
 public:
  Wearer(SimMotion motion, std::uint64_t seed, SimStart start = SimStart::kRest)
      : motion_(motion), seed_(seed), start_(start) {}

  /// Pose of the mount base at `time_s`; x right, y down, z forward.
  Rigid3 WorldFromShoulder(double time_s) const;
  /// Pose of the camera: the shoulder's with the head turned by `head`.
  Rigid3 WorldFromCamera(double time_s, const MountAngles& head) const;

 private:
  /// Body in the room: where the shoulder is, and where it faces (yaw to the right of the desk
  /// wall, pitch up, roll clockwise as seen by the wearer) [m, rad].
  struct Stance {
    Eigen::Vector3d position{2.0, 1.38, 1.02};
    double yaw = 0, pitch = -0.24, roll = 0;
  };
  Stance StanceAt(double time_s) const;
  void Breathe(double time_s, double amount, Stance& stance) const;
  Stance Desk(double time_s, double reach) const;
  Stance Walk(double time_s) const;
  Stance Turn(double time_s) const;
  Stance Rock(double time_s) const;
  Stance Roll(double time_s) const;
  Stance Stroll(double time_s) const;
  Stance Twist(double time_s) const;
  /// A smooth random signal, mostly within +-1, at rest for the first 1.2 seconds.
  double Signal(double time_s, double knot_s, std::uint64_t channel) const;
  double Random(std::uint64_t channel, std::uint64_t index) const;  // uniform in -1 .. 1

  /// What is left at `time_s` of the turn that a recording may begin with [rad].
  double StartTurn(double time_s) const;

  SimMotion motion_;
  std::uint64_t seed_;
  SimStart start_;
};

/// Rotation of a head whose axes meet in the optic centre: Ry(pan) Rx(elevation) Rz(cyclotorsion),
/// slam-spec section 8.
Rigid3 ShoulderFromCamera(const MountAngles& head);

}  // namespace saccade
