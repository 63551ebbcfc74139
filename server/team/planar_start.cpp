#include "server/team/planar_start.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

constexpr Timestamp kWindow_ns = 30'000'000'000;
constexpr Timestamp kApart_ns = 900'000'000;  // clues of one kind that are closer tell the same
constexpr std::size_t kFewest = 4, kMost = 40;
constexpr int kHeadings = 24;
constexpr double kPosition_m = 0.3, kHeading_rad = 0.15;  // how well it must be known
constexpr double kBetter = 10.0;  // how much worse the next answer must be, in chi squared

Eigen::Vector2d Turned(double heading, const Eigen::Vector2d& point) {
  return Eigen::Rotation2Dd(heading) * point;
}

Eigen::Vector3d Chained(const Eigen::Vector3d& a_from_b, const Eigen::Vector3d& b_from_c) {
  Eigen::Vector3d a_from_c;
  a_from_c << a_from_b.head<2>() + Turned(a_from_b.z(), b_from_c.head<2>()),
      a_from_b.z() + b_from_c.z();
  return a_from_c;
}

}  // namespace

void PlanarStart::Advance(Timestamp time_ns) {
  if (time_ns <= now_ns_) return;
  DrivePlanar(Seconds(time_ns - now_ns_), command_, options_, own_);
  now_ns_ = time_ns;
  while (!clues_.empty() && now_ns_ - clues_.front().time_ns > kWindow_ns) clues_.pop_front();
}

void PlanarStart::Sees(const PlanarSight& sight, const Eigen::Vector2d& place, double sigma_m) {
  Add({now_ns_, own_.head<3>(), place, sight, sigma_m});
}

void PlanarStart::SeenAt(const Eigen::Vector2d& place, double sigma_m) {
  Add({now_ns_, own_.head<3>(), place, std::nullopt, sigma_m});
}

void PlanarStart::Add(Clue clue) {
  for (auto other = clues_.rbegin(); other != clues_.rend(); ++other) {
    if (clue.time_ns - other->time_ns > kApart_ns) break;
    if (clue.sight.has_value() == other->sight.has_value() &&
        (clue.place - other->place).norm() < 0.1) {
      return;
    }
  }
  clues_.push_back(clue);
  if (clues_.size() > kMost) clues_.pop_front();
}

PlanarStart::Answer PlanarStart::Solve(double heading) const {
  Answer answer;
  Eigen::Vector3d& x = answer.world_from_own;
  x << 0, 0, heading;
  for (const Clue& clue : clues_) {
    Eigen::Vector2d own = clue.own.head<2>();
    if (clue.sight) {
      own += clue.sight->range_m *
             Turned(clue.own.z() + clue.sight->bearing_rad, Eigen::Vector2d::UnitX());
    }
    x.head<2>() += (clue.place - Turned(heading, own)) / static_cast<double>(clues_.size());
  }
  for (int k = 0; k < 15; ++k) {
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    answer.information.setZero();
    answer.cost = 0.0;
    for (const Clue& clue : clues_) {
      // Compared as places in world: the sighted thing, or the robot itself.
      Eigen::Vector2d own = clue.own.head<2>(), ray = Eigen::Vector2d::UnitX();
      const double drift = Seconds(now_ns_ - clue.time_ns);
      Eigen::Vector2d sigma =
          Eigen::Vector2d::Constant(std::hypot(clue.sigma_m, 0.02 * std::sqrt(drift)));
      if (clue.sight) {
        ray = Turned(clue.own.z() + clue.sight->bearing_rad, ray);
        own += clue.sight->range_m * ray;
        const Eigen::Matrix2d noise = SightNoise(*clue.sight, 0.0, options_);
        const double turn =
            std::hypot(std::sqrt(noise(1, 1)), options_.turn_rad * std::sqrt(drift));
        sigma.x() = std::hypot(sigma.x(), std::sqrt(noise(0, 0)));
        sigma.y() = std::hypot(sigma.y(), clue.sight->range_m * turn);
      }
      const Eigen::Vector2d turned = Turned(x.z(), own), axis = Turned(x.z(), ray);
      Eigen::Matrix2d white;
      white << axis.transpose() / sigma.x(), -axis.y() / sigma.y(), axis.x() / sigma.y();
      Eigen::Matrix<double, 2, 3> j;
      j << Eigen::Matrix2d::Identity(), Eigen::Vector2d(-turned.y(), turned.x());
      const Eigen::Vector2d r = white * (clue.place - x.head<2>() - turned);
      const Eigen::Matrix<double, 2, 3> whitened = white * j;
      const double dof = options_.student_dof > 0 ? options_.student_dof : 4.0;
      const double weight = (dof + 2.0) / (dof + r.squaredNorm());
      answer.cost += (dof + 2.0) * std::log1p(r.squaredNorm() / dof);
      answer.information += weight * whitened.transpose() * whitened;
      right += weight * whitened.transpose() * r;
    }
    const Eigen::Matrix3d damped = answer.information + 1e-6 * Eigen::Matrix3d::Identity();
    x += damped.ldlt().solve(right);
  }
  return answer;
}

std::optional<Eigen::Vector3d> PlanarStart::Pose() const {
  if (clues_.size() < kFewest) return std::nullopt;
  std::vector<Answer> answers;
  for (int k = 0; k < kHeadings; ++k) answers.push_back(Solve(2 * M_PI * k / kHeadings));
  const auto best =
      std::min_element(answers.begin(), answers.end(),
                       [](const Answer& a, const Answer& b) { return a.cost < b.cost; });
  // Most clues must agree, however few they are.
  if (!(best->cost < 6.0 * static_cast<double>(clues_.size()))) return std::nullopt;
  const Eigen::Matrix3d covariance =
      (best->information + 1e-9 * Eigen::Matrix3d::Identity()).inverse();
  const Eigen::Vector3d now = Chained(best->world_from_own, own_.head<3>());
  // What is known of where it is now, not of where its own frame is.
  const Eigen::Vector2d turned = now.head<2>() - best->world_from_own.head<2>();
  Eigen::Matrix3d to_now = Eigen::Matrix3d::Identity();
  to_now.block<2, 1>(0, 2) = Eigen::Vector2d(-turned.y(), turned.x());
  const Eigen::Matrix3d here = to_now * covariance * to_now.transpose();
  if (!(std::sqrt(here.topLeftCorner<2, 2>().trace()) < kPosition_m) ||
      !(std::sqrt(here(2, 2)) < kHeading_rad)) {
    return std::nullopt;
  }
  for (const Answer& other : answers) {
    const Eigen::Vector3d there = Chained(other.world_from_own, own_.head<3>());
    const bool same = (there - now).head<2>().norm() < 2 * kPosition_m &&
                      std::abs(std::remainder(there.z() - now.z(), 2 * M_PI)) < 2 * kHeading_rad;
    if (!same && other.cost < best->cost + kBetter) return std::nullopt;
  }
  return now;
}

}  // namespace saccade
