#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A plane z = 0 of world with a smooth random texture that can be evaluated anywhere, so that
/// pictures of it from two places agree to a fraction of a pixel.
class TexturedPlane {
 public:
  /// `grain_m`: size of the finest detail.
  TexturedPlane(std::uint64_t seed, double grain_m) : grain_m_(grain_m), values_(kSize * kSize) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (double& value : values_) value = uniform(random);
  }

  /// Grey level at a point of the plane [m].
  double At(double x, double y) const {
    const double fine = Lattice(x / grain_m_, y / grain_m_);
    const double rough = Lattice(x / (3.7 * grain_m_) + 17.3, y / (3.7 * grain_m_) + 5.1);
    return 127.0 + 110.0 * std::clamp(0.75 * fine + 0.65 * rough, -1.0, 1.0);
  }

  /// Picture from world_from_camera; each pixel is the mean of 3 x 3 rays, with Gaussian noise.
  cv::Mat Render(const CameraModel& camera, const Rigid3& world_from_camera, double noise = 0.0,
                 std::uint64_t noise_seed = 1) const {
    cv::Mat image(camera.height(), camera.width(), CV_8UC1, cv::Scalar(0));
    std::mt19937_64 random(noise_seed);
    std::normal_distribution<double> normal(0.0, noise > 0.0 ? noise : 1.0);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        double sum = 0.0;
        for (int k = 0; k < 9; ++k) {
          sum += Seen(camera, world_from_camera, {u + (k % 3 - 1) / 3.0, v + (k / 3 - 1) / 3.0});
        }
        const double value = sum / 9.0 + (noise > 0.0 ? normal(random) : 0.0);
        image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(value);
      }
    }
    return image;
  }

  /// Point of the plane that a pixel shows [m, world].
  static Eigen::Vector3d PointAt(const CameraModel& camera, const Rigid3& world_from_camera,
                                 const Eigen::Vector2d& pixel) {
    const auto ray = camera.Unproject(pixel);
    if (!ray) return Eigen::Vector3d::Constant(NAN);
    const Eigen::Vector3d direction = world_from_camera.rotation * *ray;
    return world_from_camera.translation -
           direction * (world_from_camera.translation.z() / direction.z());
  }

 private:
  static constexpr int kSize = 256;

  double Seen(const CameraModel& camera, const Rigid3& pose, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d point = PointAt(camera, pose, pixel);
    return point.allFinite() ? At(point.x(), point.y()) : 0.0;
  }
  double Value(int x, int y) const { return values_[(y & 255) * kSize + (x & 255)]; }
  /// Uniform cubic B-spline through random coefficients: twice differentiable.
  double Lattice(double x, double y) const {
    const int ix = static_cast<int>(std::floor(x));
    const int iy = static_cast<int>(std::floor(y));
    double sum = 0.0;
    for (int b = 0; b < 4; ++b) {
      for (int a = 0; a < 4; ++a) {
        sum += Weight(a, x - ix) * Weight(b, y - iy) * Value(ix + a - 1, iy + b - 1);
      }
    }
    return 2.2 * sum;
  }
  static double Weight(int k, double t) {
    switch (k) {
      case 0:
        return (1 - t) * (1 - t) * (1 - t) / 6.0;
      case 1:
        return (3 * t * t * t - 6 * t * t + 4) / 6.0;
      case 2:
        return (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6.0;
      default:
        return t * t * t / 6.0;
    }
  }

  double grain_m_;
  std::vector<double> values_;
};

}  // namespace saccade
