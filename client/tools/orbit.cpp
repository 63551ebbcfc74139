#include "client/tools/orbit.hpp"

#include <algorithm>
#include <cmath>

namespace saccade::tools {
namespace {

constexpr double kEaseMs = 60;  // time constant: 98 % there after 240 ms
constexpr double kMaxPitch = 1.5;

}  // namespace

bool Orbit::Step(double elapsed_ms) {
  const double remaining = (now_.target - goal_.target).norm() / goal_.distance +
                           std::abs(goal_.yaw - now_.yaw) + std::abs(goal_.pitch - now_.pitch) +
                           std::abs(goal_.distance / now_.distance - 1);
  if (remaining < 1e-4) {
    now_ = goal_;
    return false;
  }
  const double t = 1 - std::exp(-elapsed_ms / kEaseMs);
  now_.target += t * (goal_.target - now_.target);
  now_.yaw += t * (goal_.yaw - now_.yaw);
  now_.pitch += t * (goal_.pitch - now_.pitch);
  now_.distance *= std::pow(goal_.distance / now_.distance, t);
  return true;
}

void Orbit::Rotate(double yaw_rad, double pitch_rad) {
  Place place = goal_;
  place.yaw += yaw_rad;
  place.pitch = std::clamp(place.pitch + pitch_rad, -kMaxPitch, kMaxPitch);
  Jump(place);
}

void Orbit::Pan(double right, double down) {
  Place place = goal_;
  const Eigen::Matrix3d basis = Basis(place);
  place.target += place.distance * (right * basis.col(0) + down * basis.col(1));
  Jump(place);
}

void Orbit::Zoom(double factor, double right, double down) {
  const double from = goal_.distance;
  const double to = std::clamp(from * factor, 0.05, 500.0);
  const Eigen::Matrix3d basis = Basis(goal_);
  goal_.target += (from - to) * (right * basis.col(0) + down * basis.col(1));
  goal_.distance = to;
}

void Orbit::LookAt(const Eigen::Vector3d& target, double radius_m) {
  goal_.target = target;
  goal_.distance = 2.4 * std::max(radius_m, 0.05);
}

void Orbit::FromTop() { goal_.pitch = kMaxPitch; }

Rigid3 Orbit::world_from_camera() const {
  const Eigen::Matrix3d basis = Basis(now_);
  return {Eigen::Quaterniond(basis), now_.target - now_.distance * basis.col(2)};
}

Eigen::Matrix3d Orbit::Basis(const Place& place) {
  const Eigen::Vector3d z(std::sin(place.yaw) * std::cos(place.pitch), std::sin(place.pitch),
                          std::cos(place.yaw) * std::cos(place.pitch));
  Eigen::Matrix3d basis;
  basis.col(0) = Eigen::Vector3d::UnitY().cross(z).normalized();
  basis.col(1) = z.cross(basis.col(0));
  basis.col(2) = z;
  return basis;
}

}  // namespace saccade::tools
