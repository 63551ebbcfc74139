#include "server/scene/light_fit.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kKeep = 0.99;        // of what was known, from one picture to the next
constexpr double kPaper = 225.0;      // grey levels of white paper in good light
constexpr double kSigma = 0.05;       // relative: papers differ, shadows lie on them
constexpr double kPrior = 0.35;       // sigma of v before anything was seen
constexpr double kMostPictures = 16;  // they are worth as independent ones: all show the same wall
constexpr double kSaturated = 250.0, kDark = 12.0;
constexpr double kMost = 0.9;  // length of v: nothing is lit from one side alone

}  // namespace

void LightFit::Add(std::span<const PaperSeen> papers) {
  double mean = 0.0, count = 0.0;
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  const auto usable = [](const PaperSeen& one) {
    return one.level < kSaturated && one.level > kDark && one.normal_in_world.allFinite();
  };
  for (const PaperSeen& one : papers) {
    if (!usable(one)) continue;
    mean += one.level;
    facing += one.normal_in_world;
    count += 1.0;
  }
  if (count == 0.0) return;
  mean /= count;
  facing /= count;
  level_ = kKeep * level_ + mean;
  facing_ = kKeep * facing_ + facing;
  level_weight_ = kKeep * level_weight_ + 1.0;
  if (count < 2.0) return;
  normal_ *= kKeep;
  right_ *= kKeep;
  right_by_light_ *= kKeep;
  weight_ = kKeep * weight_ + 1.0;
  for (const PaperSeen& one : papers) {
    if (!usable(one)) continue;
    // level_k / mean = (1 + n_k . v) / (1 + facing . v), so that
    // (n_k - facing) . v = (level_k / mean - 1) (1 + facing . v): what faces as the mean says
    // nothing, however bright it is.
    const double more = one.level / mean - 1.0;
    const Eigen::Vector3d row = one.normal_in_world - facing;
    normal_ += row * row.transpose();
    right_ += row * more;
    right_by_light_ += row * more * facing.transpose();
  }
}

SceneLight LightFit::light() const {
  SceneLight light;
  if (weight_ == 0.0) return light;
  const double worth = std::min(1.0, kMostPictures / weight_) / (kSigma * kSigma);
  const Eigen::Matrix3d evidence = worth * normal_;
  const Eigen::Matrix3d all =
      evidence - worth * right_by_light_ + Eigen::Matrix3d::Identity() / (kPrior * kPrior);
  Eigen::Vector3d v = all.partialPivLu().solve(worth * right_);
  if (!v.allFinite()) v.setZero();
  if (v.norm() > kMost) v *= kMost / v.norm();
  light.toward_in_world = v;
  // How much of what is said comes from the papers: along the direction that they tell best.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(evidence);
  const double best = solver.eigenvalues()[2];
  light.confidence = best / (best + 1.0 / (kPrior * kPrior));
  const double mean = 1.0 + facing_.dot(v) / level_weight_;
  light.level = std::clamp(level_ / level_weight_ / kPaper / mean, 0.1, 1.15);
  return light;
}

}  // namespace saccade
