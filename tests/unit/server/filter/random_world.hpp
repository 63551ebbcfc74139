#pragma once

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "server/filter/filter_state.hpp"

namespace saccade {

/// Random numbers, poses and points for the filter's tests; the same for one seed.
class RandomWorld {
 public:
  explicit RandomWorld(std::uint64_t seed) : engine_(seed) {}

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double Normal(double sigma = 1.0) {
    return std::normal_distribution<double>(0.0, sigma)(engine_);
  }
  template <int kSize>
  Eigen::Matrix<double, kSize, 1> NormalVector(double sigma = 1.0) {
    Eigen::Matrix<double, kSize, 1> v;
    for (int k = 0; k < kSize; ++k) v[k] = Normal(sigma);
    return v;
  }
  Eigen::Quaterniond Rotation() { return ExpQuaternion(NormalVector<3>(1.0)); }
  Rigid3 Pose(double spread = 1.0) { return {Rotation(), NormalVector<3>(spread)}; }
  CameraMotion Motion() { return {Pose(), NormalVector<3>(0.5), NormalVector<3>(1.0), {}}; }
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

/// A 640 x 480 camera with some distortion.
inline CameraModel TestCamera(bool distorted = true) {
  CameraIntrinsics lens;
  lens.model = distorted ? LensModel::kBrownConrady : LensModel::kPinhole;
  lens.width = 640;
  lens.height = 480;
  lens.fx = 517.3;
  lens.fy = 516.5;
  lens.cx = 318.6;
  lens.cy = 255.3;
  if (distorted) lens.distortion = {0.1, -0.15, -0.002, 0.001, 0.05};
  return CameraModel(lens);
}

/// Largest difference relative to the larger matrix' largest number.
template <typename A, typename B>
double RelativeError(const A& a, const B& b) {
  const double scale = std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), 1e-9});
  return (a - b).cwiseAbs().maxCoeff() / scale;
}

}  // namespace saccade
