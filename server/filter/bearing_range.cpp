#include <cmath>

#include "server/filter/point_parametrisation.hpp"

namespace saccade {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Tangent coordinates that MoveBearing() needs to bring a bearing to `target`.
Vector2d BearingStep(const PointInClone& from, const Vector3d& target) {
  const Vector3d across = target - from.bearing.dot(target) * from.bearing;
  const double sine = across.norm();
  if (sine < 1e-12) return Vector2d::Zero();
  return std::atan2(sine, from.bearing.dot(target)) / sine * (from.basis.transpose() * across);
}

class BearingRangeForm final : public PointParametrisation {
 public:
  BearingRangeForm() : PointParametrisation(3) {}

  void Move(const Errors& error, PointInClone& point) const override {
    MoveBearing(error.head<2>(), point.bearing, point.basis);
    point.inverse_range += error[2];
  }
  Errors Minus(const Vector3d& bearing, double inverse_range,
               const PointInClone& from) const override {
    Errors error(3);
    error << BearingStep(from, bearing), inverse_range - from.inverse_range;
    return error;
  }
  Square BirthCovariance(const Matrix2d& bearing, double range_sigma) const override {
    Square covariance = Square::Zero(3, 3);
    covariance.topLeftCorner<2, 2>() = bearing;
    covariance(2, 2) = range_sigma * range_sigma;
    return covariance;
  }
  Matrix2d Frozen(const Matrix2d&) const override { return Matrix2d::Zero(); }
};

}  // namespace

const PointParametrisation& BearingRange() {
  static const BearingRangeForm form;
  return form;
}

}  // namespace saccade
