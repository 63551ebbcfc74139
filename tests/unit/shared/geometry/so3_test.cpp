#include "shared/geometry/so3.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace saccade::so3_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Rotation vectors of every size from 1e-9 rad to just under pi.
std::vector<Vector3d> RotationVectors() {
  std::mt19937 rng(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> exponent(-9, std::log10(std::numbers::pi - 1e-3));
  std::vector<Vector3d> all = {Vector3d::Zero()};
  for (int i = 0; i < 1000; ++i) {
    const Vector3d direction(normal(rng), normal(rng), normal(rng));
    all.push_back(direction.normalized() * std::pow(10.0, exponent(rng)));
  }
  return all;
}

TEST(So3, SkewIsTheCrossProduct) {
  const Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_TRUE((Skew(a) * b).isApprox(a.cross(b), 1e-15));
}

TEST(So3, LogUndoesExp) {
  for (const Vector3d& f : RotationVectors()) {
    ASSERT_LT((LogQuaternion(ExpQuaternion(f)) - f).norm(), 1e-13 + 1e-12 * f.norm())
        << f.transpose();
  }
}

TEST(So3, ExpIsTheMatrixExponential) {
  for (const Vector3d& f : RotationVectors()) {
    // Series of exp(Skew(f) / 1024), squared ten times.
    const Matrix3d small = Skew(f) / 1024.0;
    Matrix3d sum = Matrix3d::Identity(), term = Matrix3d::Identity();
    for (int k = 1; k < 12; ++k) sum += term = Matrix3d(term * small / k);
    for (int k = 0; k < 10; ++k) sum = Matrix3d(sum * sum);
    ASSERT_LT((ExpSo3(f) - sum).norm(), 1e-11) << f.transpose();
  }
}

TEST(So3, LogTakesTheShortWayForBothSignsOfAQuaternion) {
  const Quaterniond q = ExpQuaternion({0.3, -0.2, 0.9});
  const Quaterniond negative(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((LogQuaternion(q) - LogQuaternion(negative)).norm(), 1e-15);
  EXPECT_LE(LogQuaternion(ExpQuaternion({0, 0, 4.0})).norm(), std::numbers::pi);
}

// T1: Exp(f + d) = Exp(f) Exp(Jr(f) d).
TEST(So3, RightJacobianIsTheNumericOne) {
  for (const Vector3d& f : RotationVectors()) {
    const Quaterniond inverse = ExpQuaternion(f).conjugate();
    Matrix3d numeric;
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d d = kStep * Vector3d::Unit(axis);
      numeric.col(axis) = (LogQuaternion(inverse * ExpQuaternion(f + d)) -
                           LogQuaternion(inverse * ExpQuaternion(f - d))) /
                          (2 * kStep);
    }
    ASSERT_LT((RightJacobianSo3(f) - numeric).cwiseAbs().maxCoeff(), 1e-6) << f.transpose();
  }
}

TEST(So3, LeftJacobianIsTheRotatedRightJacobian) {
  for (const Vector3d& f : RotationVectors()) {
    ASSERT_LT((LeftJacobianSo3(f) - ExpSo3(f) * RightJacobianSo3(f)).norm(), 1e-9);
  }
}

TEST(So3, RightJacobianIsSmoothWhereItsSeriesBegins) {
  const Vector3d direction = Vector3d(1, 2, -2) / 3.0;
  const Matrix3d below = RightJacobianSo3(direction * 0.009999999);
  const Matrix3d above = RightJacobianSo3(direction * 0.010000001);
  EXPECT_LT((below - above).norm(), 1e-8);
}

}  // namespace
}  // namespace saccade::so3_test
