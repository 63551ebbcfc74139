#include "server/sim/wearer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr double kRestS = 1.2;  // facing the chessboard
constexpr double kTwoPi = 2.0 * std::numbers::pi;

std::uint64_t MixWearer(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// From 0 at x <= 0 to 1 at x >= 1 with speed and acceleration zero at both ends.
double MinimumJerk(double x) {
  const double c = std::clamp(x, 0.0, 1.0);
  return c * c * c * (10.0 + c * (-15.0 + 6.0 * c));
}

}  // namespace

Rigid3 WorldFromRoom() {
  // The board's first inner corner is at (1.84, 1.22, 0.008) of the room; half a turn about x.
  return {Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d(-1.84, 1.22, 0.008)};
}

Rigid3 ShoulderFromCamera(const MountAngles& head) {
  const Eigen::Quaterniond pan(Eigen::AngleAxisd(head.pan_rad, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(head.elevation_rad, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(head.cyclotorsion_rad, Eigen::Vector3d::UnitZ()));
  return {pan * tilt * roll, Eigen::Vector3d::Zero()};
}

Rigid3 Wearer::WorldFromCamera(double time_s, const MountAngles& head) const {
  return WorldFromShoulder(time_s) * ShoulderFromCamera(head);
}

Rigid3 Wearer::WorldFromShoulder(double time_s) const {
  Stance stance = StanceAt(time_s);
  if (start_ == SimStart::kTurn) stance.yaw += StartTurn(time_s);
  // Yaw, pitch and roll turn the body as pan, elevation and cyclotorsion turn the head.
  Rigid3 pose = ShoulderFromCamera({stance.yaw, stance.pitch, stance.roll});
  pose.translation = WorldFromRoom() * stance.position;
  return pose;
}

double Wearer::Random(std::uint64_t channel, std::uint64_t index) const {
  const std::uint64_t bits = MixWearer(MixWearer(seed_ * 1000003ULL + channel) + index);
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1.0;
}

double Wearer::Signal(double time_s, double knot_s, std::uint64_t channel) const {
  // Uniform cubic B-spline over random control values.
  const double x = std::max(0.0, time_s) / knot_s;
  const auto first = static_cast<std::int64_t>(std::floor(x));
  const double u = x - static_cast<double>(first);
  const double weight[4] = {(1 - u) * (1 - u) * (1 - u) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
                            (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6, u * u * u / 6};
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const std::int64_t index = first - 1 + k;
    // A control value reaches back two knots.
    if ((static_cast<double>(index) - 2) * knot_s < kRestS) continue;
    sum += weight[k] * 1.5 * Random(channel, static_cast<std::uint64_t>(index));
  }
  return sum;
}

void Wearer::Breathe(double time_s, double amount, Stance& stance) const {
  // Standing is never at rest: three axes of sway, each a sum of two sines of 0.2 to 1 Hz.
  const auto sway = [&](std::uint64_t channel) {
    double sum = 0;
    for (std::uint64_t k = 0; k < 2; ++k) {
      const double hz = (k == 0 ? 0.3 : 0.75) + 0.1 * Random(channel, 10 + k);
      const double phase = std::numbers::pi * Random(channel, 20 + k);
      sum += (k == 0 ? 1.0 : 0.4) * (std::sin(kTwoPi * hz * time_s + phase) - std::sin(phase));
    }
    return amount * sum;
  };
  stance.position += Eigen::Vector3d(0.014 * sway(1), 0.006 * sway(2), 0.016 * sway(3));
  stance.yaw += 1.1 * kDegree * sway(4);
  stance.pitch += 0.8 * kDegree * sway(5);
  stance.roll += 0.7 * kDegree * sway(6);
}

Wearer::Stance Wearer::Desk(double time_s, double reach) const {
  Stance stance;
  // Slow leans and steps of the body; the eyes follow a wandering point on the desk and the wall.
  stance.position.x() += reach * 0.34 * Signal(time_s, 1.7, 30);
  stance.position.y() += 0.12 * Signal(time_s, 1.9, 31);
  stance.position.z() += 0.20 * Signal(time_s, 1.8, 32);
  const Eigen::Vector3d looked_at(2.0 + reach * 0.55 * Signal(time_s, 1.5, 33),
                                  1.12 + 0.28 * Signal(time_s, 1.6, 34), 0.1);
  const Eigen::Vector3d line = looked_at - stance.position;
  stance.yaw = std::atan2(line.x(), -line.z());
  stance.pitch = std::atan2(line.y(), std::hypot(line.x(), line.z()));
  stance.roll = 3.0 * kDegree * Signal(time_s, 1.4, 35);
  return stance;
}

Wearer::Stance Wearer::Walk(double time_s) const {
  Stance stance;
  const double moving_s = std::max(0.0, time_s - kRestS);
  const double start = MinimumJerk(moving_s / 2.0);
  // Round the room on an oval; after the start-up, 0.55 m/s on average, 5.8 m a lap.
  const double side = Random(40, 0) > 0 ? 1.0 : -1.0;
  const double angular_speed = kTwoPi * 0.55 / 5.8;
  const double eased_s = moving_s < 2.0
                             ? 2.0 * (2.5 * std::pow(moving_s / 2, 4) -
                                      3.0 * std::pow(moving_s / 2, 5) + std::pow(moving_s / 2, 6))
                             : moving_s - 1.0;
  const double along = angular_speed * eased_s + 0.25 * Signal(time_s, 2.5, 41);
  const double wide = 0.80 + 0.08 * Signal(time_s, 3.0, 42);
  stance.position.x() = 2.0 + side * wide * std::sin(along);
  stance.position.z() = 2.02 - 1.0 * std::cos(along) + 0.05 * Signal(time_s, 2.8, 43);
  // Eyes ahead of the way and somewhat outwards, to the things along the walls.
  stance.yaw = side * (along + start * (38.0 + 14.0 * Signal(time_s, 1.8, 44)) * kDegree);
  stance.pitch = -0.24 + 0.08 * start + 0.12 * Signal(time_s, 1.7, 45);
  const double step = kTwoPi * 1.75 * eased_s;
  stance.position.y() += start * 0.018 * (1 - std::cos(step));
  stance.position.x() += start * 0.012 * std::sin(0.5 * step);
  stance.roll = start * 1.0 * kDegree * std::sin(0.5 * step);
  stance.pitch += start * 0.5 * kDegree * std::sin(step);
  return stance;
}

Wearer::Stance Wearer::Turn(double time_s) const {
  Stance stance;
  // Turns about the spine, 0.15 m behind the camera: out and back, each at its own speed.
  double yaw = 0, clock_s = kRestS;
  for (std::uint64_t k = 0; clock_s < time_s; ++k) {
    const double side = Random(50, k / 2) > 0 ? 1.0 : -1.0;
    const double angle = (105.0 + 45.0 * Random(51, k / 2)) * kDegree;
    const double peak = (85.0 + 25.0 * Random(52, k)) * kDegree;  // per second
    const double turn_s = 1.875 * angle / peak;
    yaw += (k % 2 == 0 ? side : -side) * angle * MinimumJerk((time_s - clock_s) / turn_s);
    clock_s += turn_s + 0.7 + 0.4 * Random(53, k);
  }
  stance.yaw = yaw;
  stance.position.x() += 0.15 * std::sin(yaw) + 0.10 * Signal(time_s, 1.9, 54);
  stance.position.z() += 0.15 * (1 - std::cos(yaw)) + 0.08 * Signal(time_s, 1.7, 55);
  stance.pitch += 0.12 * Signal(time_s, 1.8, 56);
  return stance;
}

// What slam-spec's T25 asks of a wearer: 3 cm and 6 deg at 0.5 Hz.
Wearer::Stance Wearer::Rock(double time_s) const {
  Stance stance;
  const double start = MinimumJerk((time_s - kRestS) / 1.5);
  const double phase = kTwoPi * 0.5 * (time_s - kRestS);
  const double own = std::numbers::pi * Random(60, 0);
  stance.position += start * 0.03 *
                     Eigen::Vector3d(std::sin(phase), 0.4 * std::sin(phase + own + 2.0),
                                     0.7 * std::sin(phase + own + 4.0));
  stance.yaw += start * 6.0 * kDegree * std::sin(phase + own);
  stance.pitch += start * 3.0 * kDegree * std::sin(phase + 1.3);
  stance.roll += start * 2.0 * kDegree * std::sin(phase + own + 2.6);
  return stance;
}

// T27: the shoulder rolls by +-20 deg at 0.2 Hz.
Wearer::Stance Wearer::Roll(double time_s) const {
  Stance stance;
  const double start = MinimumJerk((time_s - kRestS) / 2.0);
  stance.roll += start * 20.0 * kDegree * std::sin(kTwoPi * 0.2 * (time_s - kRestS));
  return stance;
}

// Walks to and fro in the middle of the room and looks about: at most 0.35 m/s and 16 deg/s, so
// that a head of 30 deg/s can follow.
Wearer::Stance Wearer::Stroll(double time_s) const {
  Stance stance;
  const double moving_s = std::max(0.0, time_s - kRestS);
  const double start = MinimumJerk(moving_s / 3.0);
  const double side = Random(70, 0) > 0 ? 1.0 : -1.0;
  stance.position.x() += side * start * 0.65 * std::sin(kTwoPi * moving_s / 13.0);
  stance.position.z() += start * 0.55 * (1 - std::cos(kTwoPi * moving_s / 17.0));
  stance.yaw += side * start * 38.0 * kDegree * std::sin(kTwoPi * moving_s / 16.0);
  const double step = kTwoPi * 1.4 * moving_s;
  stance.position.y() += start * 0.012 * (1 - std::cos(step));
  stance.roll += start * 0.8 * kDegree * std::sin(0.5 * step);
  stance.pitch += start * (0.10 + 0.4 * kDegree * std::sin(step));
  return stance;
}

// In the hand: about one axis after the other, 30 deg to and fro at up to 65 deg/s, hardly any way.
Wearer::Stance Wearer::Twist(double time_s) const {
  Stance stance;
  constexpr double kTurn_s = 6.0;  // about one axis
  const double moving_s = std::max(0.0, time_s - kRestS);
  const auto turn = static_cast<std::uint64_t>(moving_s / kTurn_s);
  const double in_turn_s = moving_s - kTurn_s * static_cast<double>(turn);
  const double fade = MinimumJerk(in_turn_s / 1.0) * MinimumJerk((kTurn_s - in_turn_s) / 1.0);
  const double hz = 0.31 + 0.03 * Random(80, turn);
  const double angle = 30.0 * kDegree * fade * std::sin(kTwoPi * hz * in_turn_s);
  const std::uint64_t first = Random(81, 0) > 0 ? 0 : 1;
  double* const axes[] = {&stance.yaw, &stance.pitch, &stance.roll};
  *axes[(first + turn) % 3] += angle;
  stance.position += 0.04 * Eigen::Vector3d(Signal(time_s, 1.6, 82), Signal(time_s, 1.7, 83),
                                            Signal(time_s, 1.5, 84));
  return stance;
}

// tum_fr1_rpy begins so: 70 deg within its first second.
double Wearer::StartTurn(double time_s) const {
  constexpr double kAway = 70.0 * kDegree, kTurn_s = 1.5;
  const double side = Random(90, 0) > 0 ? 1.0 : -1.0;
  return side * kAway * (1.0 - MinimumJerk(time_s / kTurn_s));
}

Wearer::Stance Wearer::StanceAt(double time_s) const {
  Stance stance;
  double sway = 0.15 + 0.85 * MinimumJerk((time_s - kRestS) / 1.5);
  switch (motion_) {
    case SimMotion::kStill:
      return stance;
    case SimMotion::kSway:
      stance = Desk(time_s, 0.6);
      break;
    case SimMotion::kDesk:
      stance = Desk(time_s, 1.0);
      break;
    case SimMotion::kWalk:
      stance = Walk(time_s);
      sway *= 0.4;
      break;
    case SimMotion::kRock:
      return Rock(time_s);
    case SimMotion::kRoll:
      return Roll(time_s);
    case SimMotion::kStroll:
      stance = Stroll(time_s);
      sway *= 0.4;
      break;
    case SimMotion::kTwist:
      stance = Twist(time_s);
      break;
    case SimMotion::kStand:
      break;
    case SimMotion::kTurn:
      stance = Turn(time_s);
      break;
  }
  Breathe(time_s, sway, stance);
  return stance;
}

}  // namespace saccade
