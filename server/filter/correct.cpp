// The part of FilterState that moves estimates, and its covariance along with them.
#include <algorithm>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::VectorXd;

void FilterState::CarryScale(const VectorXd& step, int number) {
  Island& island = IslandAt(number);
  if (island.updates <= options_.carry_scale_after) return;
  VectorXd w = VectorXd::Zero(island.p.dim());
  VectorXd d = VectorXd::Zero(island.p.dim());
  double total = 0.0;
  for (const Feature& feature : In(number, features_)) {
    const int at = At(feature.block) + form_->range();
    const double rho = feature.point.inverse_range;
    if (rho < options_.min_inverse_range) continue;
    // Weight by information; w^T N = 1 for the scale direction N = (positions, -rho).
    const double information = rho * rho / std::max(island.p.at(at, at), 1e-12);
    w[at] = -information / rho;
    total += information;
    d[at] = -step[at];
  }
  if (total <= 0.0) return;
  w /= total;
  for (const Robot& robot : In(number, robots_)) {
    const int at = At(robot.block), size = robot.model->dim();
    d.segment(at, size) = robot.model->OfScale(step.segment(at, size));
  }
  if (!Fej(number)) {
    for (const Clone& clone : In(number, clones_)) {
      d.segment<3>(At(clone.block)) = step.segment<3>(At(clone.block));
    }
  }
  island.p.TransformRankOne(d, w);
}

void FilterState::Correct(const VectorXd& error, int number) {
  Island& island = IslandAt(number);
  // P is in the tangent space before the correction; G = Jr(d) carries it to the one after.
  constexpr double kNegligible_rad = 1e-9;
  const auto carry = [&](int offset) {
    const Eigen::Vector3d turned = error.segment<3>(offset);
    if (turned.squaredNorm() < kNegligible_rad * kNegligible_rad) return;
    island.p.TransformBlock(offset, RightJacobianSo3(turned));
  };
  for (Robot& robot : In(number, robots_)) {
    const int at = At(robot.block);
    robot.motion = robot.model->Plus(robot.motion, error.segment(at, robot.model->dim()));
    carry(at + 3);
    if (robot.readout != kNoBlock) robot.readout_s += error[At(robot.readout)];
  }
  for (Clone& clone : In(number, clones_)) {
    clone.pose = PlusPose(clone.pose, error.segment<6>(At(clone.block)));
    carry(At(clone.block) + 3);
  }
  for (Feature& feature : In(number, features_)) {
    form_->Move(error.segment(At(feature.block), form_->dim()), feature.point);
  }
}

}  // namespace saccade
