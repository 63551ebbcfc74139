#include "server/map/start_guess.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kFewest = 5;           // rays that two keyframes share
constexpr double kLeastShare = 0.1;  // of the median inverse range: nothing is behind the camera

double MedianInverseRange(const StartProblem& problem) {
  std::vector<double> all;
  for (const StartPoint& point : problem.points) all.push_back(point.inverse_range);
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  return std::max(1e-6, all[all.size() / 2]);
}

}  // namespace

StartProblem GuessTurns(const StartProblem& problem) {
  StartProblem guess = problem;
  const double median = MedianInverseRange(problem);
  for (StartPoint& point : guess.points) {
    point.bearing = point.seen.At(problem.readout_s);
    point.inverse_range = median;
  }
  const auto keyframes = std::ssize(problem.world_from_camera);
  // In order of time: where each keyframe was is known when its own points are seen later.
  for (std::ptrdiff_t k = 1; k < keyframes; ++k) {
    Matrix3d sum = Matrix3d::Zero();
    int shared = 0;
    for (const StartSighting& sighting : problem.sightings) {
      if (sighting.keyframe != k) continue;
      const StartPoint& point = guess.points[static_cast<std::size_t>(sighting.point)];
      if (point.anchor >= k) continue;
      const Quaterniond& anchor =
          guess.world_from_camera[static_cast<std::size_t>(point.anchor)].rotation;
      const Vector3d ray = sighting.seen.At(problem.readout_s);
      sum += (anchor * point.bearing) * ray.transpose();
      ++shared;
    }
    Rigid3& pose = guess.world_from_camera[static_cast<std::size_t>(k)];
    pose.translation = guess.world_from_camera.front().translation;
    if (shared < kFewest) continue;
    const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix3d keep = Matrix3d::Identity();
    keep(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    pose.rotation = Quaterniond(svd.matrixU() * keep * svd.matrixV().transpose()).normalized();
  }
  return guess;
}

StartProblem Reversed(const StartProblem& problem) {
  StartProblem guess = problem;
  const double median = MedianInverseRange(problem);
  for (StartPoint& point : guess.points) {
    point.inverse_range = std::max(kLeastShare * median, 2.0 * median - point.inverse_range);
  }
  const Rigid3& first = problem.world_from_camera.front();
  for (std::size_t k = 1; k < guess.world_from_camera.size(); ++k) {
    Rigid3& pose = guess.world_from_camera[k];
    const Vector3d ahead = (pose.rotation * Vector3d::UnitZ() + first.rotation * Vector3d::UnitZ());
    const Vector3d way = median * (pose.translation - first.translation);
    const Vector3d middle = ahead.normalized();
    pose.rotation =
        (Quaterniond::FromTwoVectors(middle - way, middle + way) * pose.rotation).normalized();
    pose.translation = 2.0 * first.translation - pose.translation;
  }
  return guess;
}

namespace {

/// n of the plane n^T X = 1 in the first keyframe: inverse depths are linear in the picture.
std::optional<Vector3d> FitPlane(const StartProblem& problem) {
  constexpr int kRounds = 4;
  constexpr double kHuberShare = 0.05;  // of the median inverse depth
  const Rigid3 camera_from_world = problem.world_from_camera.front().Inverse();
  std::vector<Vector3d> rays;
  std::vector<double> inverse_depths;
  for (const StartPoint& point : problem.points) {
    const Rigid3& anchor = problem.world_from_camera[static_cast<std::size_t>(point.anchor)];
    const Vector3d at = camera_from_world * (anchor * (point.bearing / point.inverse_range));
    if (!(at.z() > 0.0)) continue;
    rays.push_back(at / at.z());
    inverse_depths.push_back(1.0 / at.z());
  }
  if (rays.size() < 8) return std::nullopt;
  const double huber = kHuberShare * MedianInverseRange(problem);
  Vector3d normal = Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Matrix3d a = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const double off = round > 0 ? std::abs(normal.dot(rays[k]) - inverse_depths[k]) : huber;
      const double weight = off > huber ? huber / off : 1.0;
      a += weight * rays[k] * rays[k].transpose();
      b += weight * inverse_depths[k] * rays[k];
    }
    normal = a.ldlt().solve(b);
  }
  if (!normal.allFinite()) return std::nullopt;
  return normal;
}

/// The normal of the other reading of h = R + t n^T (middle singular value 1), of length 1, towards
/// what is seen: one of two vectors across which h keeps lengths.
std::optional<Vector3d> OtherNormal(const Matrix3d& h, const Vector3d& normal) {
  constexpr double kAlike = 0.98;  // cosine
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(h.transpose() * h);
  const Vector3d squares = solver.eigenvalues();  // rising; the middle one is 1
  const Matrix3d& axes = solver.eigenvectors();
  const double along = std::sqrt(std::max(0.0, 1.0 - squares[0]));
  const double across = std::sqrt(std::max(0.0, squares[2] - 1.0));
  if (!(along + across > 0.0)) return std::nullopt;  // it only turns
  std::optional<Vector3d> other;
  double likeness = kAlike;
  for (const double sign : {1.0, -1.0}) {
    const Vector3d kept = along * axes.col(2) + sign * across * axes.col(0);
    const Vector3d candidate = axes.col(1).cross(kept).normalized();
    const double alike = std::abs(candidate.dot(normal.normalized()));
    if (alike >= likeness) continue;
    likeness = alike;
    other = candidate;
  }
  return other;
}

/// R and t of h = R + t n^T for this n, up to what does not fit.
Rigid3 TakeApart(const Matrix3d& h, const Vector3d& normal) {
  const Vector3d n = normal.normalized();
  Matrix3d from, to;
  from.col(0) = n.unitOrthogonal();
  from.col(1) = n.cross(from.col(0));
  from.col(2) = from.col(0).cross(from.col(1));
  to.col(0) = h * from.col(0);
  to.col(1) = h * from.col(1);
  to.col(2) = to.col(0).cross(to.col(1));
  const Eigen::JacobiSVD<Matrix3d> svd(to * from.transpose(),
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  return {Quaterniond(turn).normalized(), (h - turn) * n / normal.norm()};
}

}  // namespace

std::optional<StartProblem> OtherPlane(const StartProblem& problem) {
  const auto normal = FitPlane(problem);
  if (!normal) return std::nullopt;
  const Rigid3 first = problem.world_from_camera.front();
  std::vector<Matrix3d> induced;
  for (const Rigid3& pose : problem.world_from_camera) {
    const Rigid3 since = pose.Inverse() * first;
    Matrix3d h = since.RotationMatrix() + since.translation * normal->transpose();
    h /= Eigen::JacobiSVD<Matrix3d>(h).singularValues()[1];
    induced.push_back(h);
  }
  auto other = OtherNormal(induced.back(), *normal);
  if (!other) return std::nullopt;
  const double median = MedianInverseRange(problem);
  std::vector<double> ranges;
  for (const StartPoint& point : problem.points) {
    if (point.anchor == 0) ranges.push_back(other->dot(point.bearing));
  }
  if (ranges.empty()) return std::nullopt;
  std::nth_element(ranges.begin(), ranges.begin() + std::ssize(ranges) / 2, ranges.end());
  const double range = ranges[ranges.size() / 2];  // its sign: which side is before the camera
  if (std::abs(range) < kLeastShare) return std::nullopt;
  *other *= median / range;
  StartProblem guess = problem;
  std::vector<Vector3d> normals = {*other};  // in each keyframe
  for (std::size_t k = 1; k < induced.size(); ++k) {
    const Rigid3 since = TakeApart(induced[k], *other);
    guess.world_from_camera[k] = first * since.Inverse();
    const Vector3d turned = since.rotation * *other;
    normals.push_back(turned / (1.0 + turned.dot(since.translation)));
  }
  for (StartPoint& point : guess.points) {
    point.inverse_range = std::max(
        kLeastShare * median, normals[static_cast<std::size_t>(point.anchor)].dot(point.bearing));
  }
  return guess;
}

}  // namespace saccade
