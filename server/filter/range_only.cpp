#include "server/filter/point_parametrisation.hpp"

namespace saccade {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector3d;

class RangeOnlyForm final : public PointParametrisation {
 public:
  RangeOnlyForm() : PointParametrisation(1) {}

  void Move(const Errors& error, PointInClone& point) const override {
    point.inverse_range += error[0];
  }
  Errors Minus(const Vector3d&, double inverse_range, const PointInClone& from) const override {
    return Errors::Constant(1, inverse_range - from.inverse_range);
  }
  Square BirthCovariance(const Matrix2d&, double range_sigma) const override {
    return Square::Constant(1, 1, range_sigma * range_sigma);
  }
  Matrix2d Frozen(const Matrix2d& bearing) const override { return bearing; }
};

}  // namespace

const PointParametrisation& RangeOnly() {
  static const RangeOnlyForm form;
  return form;
}

}  // namespace saccade
