#include "server/map/start_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {

using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

constexpr double kKnownShare = 0.25;  // sigma / inverse range of a point that counts as known
constexpr double kAgreeSigmas = 3.0;

}  // namespace

MatrixXd ToOurErrors(const StartProblem& found, const std::vector<BearingOf>& bearings,
                     const MatrixXd& covariance) {
  const auto keyframes = std::ssize(found.world_from_camera);
  MatrixXd j = MatrixXd::Zero(covariance.rows(), covariance.rows());
  j(0, 0) = 1.0;
  for (Eigen::Index k = 0; k < keyframes; ++k) {
    const Rigid3& pose = found.world_from_camera[static_cast<std::size_t>(k)];
    j.block<3, 3>(1 + 6 * k, 1 + 6 * k + 3).setIdentity();
    j.block<3, 3>(1 + 6 * k + 3, 1 + 6 * k) = 2.0 * pose.RotationMatrix().transpose();
  }
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = 1 + 6 * keyframes + 3 * static_cast<Eigen::Index>(k);
    j.block<2, 2>(at, at) = TangentBasis(found.points[k].bearing).transpose() * bearings[k].basis;
    j(at + 2, at + 2) = 1.0;
  }
  return j * covariance * j.transpose();
}

void HoldScale(const StartProblem& found, MatrixXd& information) {
  const Eigen::Index first = 1 + 6 * std::ssize(found.world_from_camera);
  Eigen::VectorXd row = Eigen::VectorXd::Zero(information.rows());
  double total = 0.0;
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = first + 3 * static_cast<Eigen::Index>(k) + 2;
    const double rho = found.points[k].inverse_range;
    if (rho <= 0.0) continue;
    row[at] = rho * information(at, at);
    total += rho * rho * information(at, at);
  }
  if (total <= 0.0) return;
  constexpr double kHeld = 1e-5;  // relative sigma
  row /= total * kHeld;
  information += row * row.transpose();
}

StartEvidence Weigh(const StartProblem& found, const MatrixXd& covariance,
                    const Eigen::VectorXd& residuals) {
  StartEvidence evidence;
  const Eigen::Index keyframes = std::ssize(found.world_from_camera);
  for (Eigen::Index k = 1; k < keyframes; ++k) {
    for (Eigen::Index l = 0; l < k; ++l) {
      const Vector3d way = found.world_from_camera[static_cast<std::size_t>(k)].translation -
                           found.world_from_camera[static_cast<std::size_t>(l)].translation;
      const double squared = way.squaredNorm();
      if (squared <= 0.0) continue;
      const auto block = [&](Eigen::Index a, Eigen::Index b) {
        return way.dot(covariance.block<3, 3>(1 + 6 * a, 1 + 6 * b) * way) / squared;
      };
      const double variance = (block(k, k) + block(l, l) - 2.0 * block(k, l)) / squared;
      evidence.scale_sigma = std::min(evidence.scale_sigma, std::sqrt(std::max(0.0, variance)));
    }
  }
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = 1 + 6 * keyframes + 3 * static_cast<Eigen::Index>(k) + 2;
    const double rho = found.points[k].inverse_range;
    evidence.known_points +=
        rho > 0.0 && covariance(at, at) < kKnownShare * kKnownShare * rho * rho ? 1 : 0;
  }
  const Eigen::Index from = 3 * std::ssize(found.points);
  const Eigen::Index count = (residuals.size() - from) / 2;
  Eigen::Index agree = 0;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double squared = residuals.segment<2>(from + 2 * k).squaredNorm();
    // The loss has been applied: |r|^2 as it counts.
    const double plain = std::expm1(std::min(50.0, squared));
    agree += plain < kAgreeSigmas * kAgreeSigmas ? 1 : 0;
    sum += std::min(plain, kAgreeSigmas * kAgreeSigmas);
  }
  if (count == 0) return evidence;
  evidence.agreeing = static_cast<double>(agree) / static_cast<double>(count);
  const double unknowns = 6.0 * static_cast<double>(keyframes - 1) + std::ssize(found.points);
  evidence.noise = std::sqrt(sum / std::max(1.0, 2.0 * static_cast<double>(count) - unknowns));
  return evidence;
}

bool GoAlike(const StartProblem& a, const StartProblem& b) {
  constexpr double kCosine = 0.9;
  const auto way = [](const StartProblem& found) {
    return Vector3d(found.world_from_camera.back().translation -
                    found.world_from_camera.front().translation);
  };
  return way(a).dot(way(b)) > kCosine * way(a).norm() * way(b).norm();
}

void ScaleTo(double range, StartSolution& solution) {
  StartProblem& found = solution.problem;
  std::vector<double> all;
  for (const StartPoint& point : found.points) all.push_back(point.inverse_range);
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  const double median = all[all.size() / 2];
  if (median <= 0.0) return;
  const double scale = range * median;  // of lengths
  const Vector3d origin = found.world_from_camera.front().translation;
  Eigen::VectorXd by = Eigen::VectorXd::Ones(solution.covariance.rows());
  Eigen::Index at = 1;
  for (Rigid3& pose : found.world_from_camera) {
    pose.translation = origin + scale * (pose.translation - origin);
    by.segment<3>(at).setConstant(scale);
    at += 6;
  }
  for (StartPoint& point : found.points) {
    point.inverse_range /= scale;
    by[at + 2] = 1.0 / scale;
    at += 3;
  }
  solution.covariance = by.asDiagonal() * solution.covariance * by.asDiagonal();
}

}  // namespace saccade
