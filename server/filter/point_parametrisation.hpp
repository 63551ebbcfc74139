#pragma once

#include <Eigen/Dense>

#include "server/filter/point_model.hpp"

namespace saccade {

/// What of a point is in the state, and how it moves there (docs/derivations/state.md). Without
/// state of its own; one file for each form.
///
/// A point has three errors [bearing tangent (2), inverse range (1)], as the columns of
/// PixelPrediction::d_point. A form keeps the last dim() of them; the inverse range is always kept.
class PointParametrisation {
 public:
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;               // dim
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;  // dim x dim

  virtual ~PointParametrisation() = default;

  /// Numbers of a point in the state, and columns of a Jacobian by them.
  int dim() const { return dim_; }
  /// Which of them is the inverse range.
  int range() const { return dim_ - 1; }
  /// Of a Jacobian by a point's three errors, the columns that the state has.
  template <typename Jacobian>
  auto InState(const Jacobian& d_point) const {
    return d_point.rightCols(dim_);
  }

  /// `point` [+] `error`.
  virtual void Move(const Errors& error, PointInClone& point) const = 0;
  /// Error that moves `from` to another bearing (unit) and inverse range [1/m].
  virtual Errors Minus(const Eigen::Vector3d& bearing, double inverse_range,
                       const PointInClone& from) const = 0;
  /// Covariance of a point as born: of its bearing (tangent) and its inverse range.
  virtual Square BirthCovariance(const Eigen::Matrix2d& bearing, double range_sigma) const = 0;
  /// What of the bearing's covariance at birth the state does not have: noise of every prediction.
  virtual Eigen::Matrix2d Frozen(const Eigen::Matrix2d& bearing) const = 0;

 protected:
  explicit PointParametrisation(int dim) : dim_(dim) {}

 private:
  const int dim_;
};

/// SID: bearing and inverse range, 3 numbers.
const PointParametrisation& BearingRange();
/// ESID: the inverse range alone, 1 number; the bearing stays as born.
const PointParametrisation& RangeOnly();

inline const PointParametrisation& ParametrisationOf(PointForm form) {
  return form == PointForm::kBearingRange ? BearingRange() : RangeOnly();
}

}  // namespace saccade
