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

}  // namespace saccade
