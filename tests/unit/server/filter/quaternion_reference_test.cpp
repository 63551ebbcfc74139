// T2: the 12-dimensional error-state filter against the filter of the sources (D03, S14): 13
// numbers, quaternion components in the state, normalised after each update with the Jacobian N.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>

#include "server/filter/filter_state.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::quaternion_reference_test {
namespace {

using Vector13d = Eigen::Matrix<double, 13, 1>;  // r, q (w x y z), v, w
using Matrix13d = Eigen::Matrix<double, 13, 13>;

/// Central differences; nothing in the reference is derived by hand.
Eigen::MatrixXd Differentiate(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                              const Eigen::VectorXd& at) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd jacobian;
  for (Eigen::Index k = 0; k < at.size(); ++k) {
    Eigen::VectorXd plus = at, minus = at;
    plus[k] += kStep;
    minus[k] -= kStep;
    const Eigen::VectorXd column = (f(plus) - f(minus)) / (2 * kStep);
    if (k == 0) jacobian.resize(column.size(), at.size());
    jacobian.col(k) = column;
  }
  return jacobian;
}

class QuaternionFilter {
 public:
  QuaternionFilter(const Matrix12d& covariance) {
    x_.setZero();
    x_[3] = 1.0;
    // P_q = L P_th L^T: half the imaginary columns of the left-product matrix, at the identity.
    Eigen::Matrix<double, 13, 12> lift = Eigen::Matrix<double, 13, 12>::Zero();
    lift.block<3, 3>(0, 0).setIdentity();
    lift.block<3, 3>(4, 3) = 0.5 * Eigen::Matrix3d::Identity();
    lift.block<6, 6>(7, 6).setIdentity();
    p_ = lift * covariance * lift.transpose();
  }

  void Predict(double dt, const MotionNoise& noise) {
    const auto move = [dt](const Eigen::VectorXd& all) -> Eigen::VectorXd {
      Vector13d x = all.head<13>();
      x.segment<3>(7) += all.segment<3>(13);
      x.segment<3>(10) += all.segment<3>(16);
      x.segment<3>(0) += dt * x.segment<3>(7);
      const Eigen::Quaterniond turn = ExpQuaternion(dt * x.segment<3>(10));
      const Eigen::Quaterniond q(x[3], x[4], x[5], x[6]);
      const Eigen::Quaterniond turned = q * turn;
      x.segment<4>(3) << turned.w(), turned.vec();
      return x;
    };
    Eigen::VectorXd at = Eigen::VectorXd::Zero(19);
    at.head<13>() = x_;
    const Eigen::MatrixXd jacobian = Differentiate(move, at);
    Eigen::Matrix<double, 6, 1> sigma;
    sigma << Eigen::Vector3d::Constant(dt * noise.acceleration_m_s2),
        Eigen::Vector3d::Constant(dt * noise.angular_acceleration_rad_s2);
    const Eigen::MatrixXd g = jacobian.rightCols<6>() * sigma.asDiagonal();
    const Eigen::MatrixXd f = jacobian.leftCols<13>();
    x_ = move(at);
    p_ = (f * p_ * f.transpose() + g * g.transpose()).eval();
  }

  void Update(const CameraModel& lens, const std::vector<Observation>& seen) {
    const auto m = 2 * static_cast<Eigen::Index>(seen.size());
    const auto project = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      Eigen::VectorXd pixels(m);
      const Eigen::Quaterniond q = Eigen::Quaterniond(x[3], x[4], x[5], x[6]).normalized();
      for (std::size_t k = 0; k < seen.size(); ++k) {
        const Eigen::Vector3d ray = q.conjugate() * (*seen[k].known_point - x.head<3>());
        pixels.segment<2>(2 * static_cast<Eigen::Index>(k)) = *lens.Project(ray);
      }
      return pixels;
    };
    Eigen::VectorXd innovation = -project(x_);
    Eigen::MatrixXd r = Eigen::MatrixXd::Zero(m, m);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const auto row = 2 * static_cast<Eigen::Index>(k);
      innovation.segment<2>(row) += seen[k].pixel;
      r.block<2, 2>(row, row) = seen[k].noise;
    }
    const Eigen::MatrixXd h = Differentiate(project, x_);
    const Eigen::MatrixXd s = h * p_ * h.transpose() + r;
    const Eigen::MatrixXd gain = p_ * h.transpose() * s.inverse();
    x_ += gain * innovation;
    p_ = (p_ - gain * s * gain.transpose()).eval();
    const Eigen::Vector4d q = x_.segment<4>(3);
    Matrix13d normalise = Matrix13d::Identity();
    normalise.block<4, 4>(3, 3) =
        (Eigen::Matrix4d::Identity() - q * q.transpose() / q.squaredNorm()) / q.norm();
    x_.segment<4>(3) /= q.norm();
    p_ = (normalise * p_ * normalise.transpose()).eval();
  }

  Rigid3 pose() const {
    return {Eigen::Quaterniond(x_[3], x_[4], x_[5], x_[6]).normalized(), x_.head<3>()};
  }

 private:
  Vector13d x_;
  Matrix13d p_;
};

TEST(QuaternionReference, ErrorStateGivesTheSamePoseT2) {
  RandomWorld world(2);
  const CameraModel lens = TestCamera();
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 40; ++k) {
    points.push_back({world.Uniform(-1.5, 1.5), world.Uniform(-1.2, 1.2), world.Uniform(1.5, 4)});
  }
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.02),
      Eigen::Vector3d::Constant(0.2), Eigen::Vector3d::Constant(0.3);
  const Matrix12d prior = sigma.cwiseAbs2().asDiagonal();
  FilterOptions options;
  options.fej = false;
  options.fej_updates = 0;
  FilterState filter(options);
  filter.Reset(CameraMotion(), prior);
  QuaternionFilter reference(prior);
  const MotionNoise noise{1.0, 6.0};
  double worst = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    const double t = k / 30.0;
    const Rigid3 truth{
        ExpQuaternion({0.3 * std::sin(1.1 * t), 0.5 * std::sin(0.7 * t), 0.2 * std::sin(t)}),
        {0.3 * std::sin(0.8 * t), 0.2 * std::sin(1.3 * t), 0.2 * std::sin(0.6 * t)}};
    filter.Predict(1.0 / 30, noise);
    reference.Predict(1.0 / 30, noise);
    std::vector<Observation> seen;
    for (const Eigen::Vector3d& point : points) {
      const auto pixel = lens.Project(truth.Inverse() * point);
      if (!pixel || !lens.InImage(*pixel) || seen.size() == 15) continue;
      Observation observation;
      observation.known_point = point;
      observation.pixel = *pixel + world.NormalVector<2>(1.0);
      seen.push_back(observation);
    }
    ASSERT_GE(seen.size(), 4U) << "frame " << k;
    ASSERT_TRUE(filter.Update(lens, seen, filter.camera().world_from_camera).ok());
    reference.Update(lens, seen);
    const Rigid3 pose = filter.camera().world_from_camera;
    Eigen::Matrix<double, 6, 1> difference;
    difference << reference.pose().translation - pose.translation,
        LogQuaternion(pose.rotation.conjugate() * reference.pose().rotation);
    const Eigen::Matrix<double, 6, 1> spread = filter.PoseCovariance().diagonal().cwiseSqrt();
    worst = std::max(worst, difference.cwiseQuotient(spread).cwiseAbs().maxCoeff());
    ASSERT_LT((pose.translation - truth.translation).norm(), 0.1) << "frame " << k;
  }
  std::printf("T2: largest difference of pose in 1000 steps: %.4f sigma\n", worst);
  EXPECT_LT(worst, 0.05);
}

}  // namespace
}  // namespace saccade::quaternion_reference_test
