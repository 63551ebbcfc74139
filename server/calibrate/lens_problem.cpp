#include "server/calibrate/lens_problem.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace saccade {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Perspective-n-point works on a plane before the camera: rays beyond this say little of it.
constexpr double kWidestRay_rad = 1.2;

cv::Matx33d Matrix(const VectorXd& lens) {
  return {lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1};
}
cv::Mat Coefficients(const VectorXd& lens) {
  cv::Mat out(1, static_cast<int>(lens.size()) - 4, CV_64F);
  for (int k = 0; k < out.cols; ++k) out.at<double>(k) = lens[4 + k];
  return out;
}

MatrixXd Columns(const cv::Mat& from, int first, int count) {
  MatrixXd out(from.rows, count);
  for (int row = 0; row < from.rows; ++row) {
    for (int k = 0; k < count; ++k) out(row, k) = from.at<double>(row, first + k);
  }
  return out;
}

/// Huber's cost of an error of this length, twice.
double HuberCost(double length, double width) {
  return length <= width ? length * length : width * (2 * length - width);
}

}  // namespace

struct LensProblem::Normal {
  MatrixXd lens_lens, lens_pose;
  Eigen::Matrix<double, 6, 6> pose_pose;
  VectorXd lens_gradient;
  BoardPose pose_gradient;
  double weighted_squares = 0;
};

bool LensProblem::StartPose(const VectorXd& lens, const BoardView& view, BoardPose& pose) const {
  std::vector<cv::Point2d> rays;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> straight;
  if (fisheye_) {
    cv::fisheye::undistortPoints(view.corners, straight, Matrix(lens), Coefficients(lens));
  } else {
    cv::undistortPoints(view.corners, straight, Matrix(lens), Coefficients(lens));
  }
  for (std::size_t k = 0; k < straight.size(); ++k) {
    if (!(cv::norm(straight[k]) < std::tan(kWidestRay_rad))) continue;
    rays.push_back(straight[k]);
    points.push_back(view.points[k]);
  }
  if (rays.size() < 6) return false;
  cv::Vec3d rotation, translation;
  try {
    const cv::Matx33d identity = cv::Matx33d::eye();
    if (!cv::solvePnP(points, rays, identity, {}, rotation, translation, false,
                      cv::SOLVEPNP_IPPE)) {
      return false;
    }
  } catch (const cv::Exception&) {  // points on a line
    return false;
  }
  pose << rotation[0], rotation[1], rotation[2], translation[0], translation[1], translation[2];
  return pose.allFinite() && pose[5] > 0;
}

VectorXd LensProblem::Residuals(const VectorXd& lens, const BoardPose& pose, const BoardView& view,
                                MatrixXd* by_lens, MatrixXd* by_pose) const {
  std::vector<cv::Point2d> seen;
  cv::Mat jacobian;
  const cv::Vec3d rotation(pose[0], pose[1], pose[2]), translation(pose[3], pose[4], pose[5]);
  const bool wanted = by_lens != nullptr;
  const auto out = wanted ? cv::OutputArray(jacobian) : cv::noArray();
  if (fisheye_) {
    cv::fisheye::projectPoints(view.points, seen, rotation, translation, Matrix(lens),
                               Coefficients(lens), 0, out);
  } else {
    cv::projectPoints(view.points, rotation, translation, Matrix(lens), Coefficients(lens), seen,
                      out);
  }
  if (wanted && fisheye_) {  // [f c k rotation translation skew]
    *by_lens = Columns(jacobian, 0, 8);
    *by_pose = Columns(jacobian, 8, 6);
  } else if (wanted) {  // [rotation translation f c k]
    *by_lens = Columns(jacobian, 6, parameters_);
    *by_pose = Columns(jacobian, 0, 6);
  }
  VectorXd residuals(2 * view.corners.size());
  for (std::size_t k = 0; k < view.corners.size(); ++k) {
    residuals[2 * k] = seen[k].x - view.corners[k].x;
    residuals[2 * k + 1] = seen[k].y - view.corners[k].y;
  }
  return residuals;
}

LensProblem::Normal LensProblem::Accumulate(const VectorXd& lens, const BoardPose& pose,
                                            const BoardView& view, const std::vector<bool>& free,
                                            double huber_px) const {
  MatrixXd by_lens, by_pose;
  const VectorXd residuals = Residuals(lens, pose, view, &by_lens, &by_pose);
  for (int k = 0; k < parameters(); ++k) {
    if (!free[k]) by_lens.col(k).setZero();
  }
  VectorXd weights(residuals.size());
  for (Eigen::Index k = 0; k < residuals.size(); k += 2) {
    const double length = residuals.segment<2>(k).norm();
    weights[k] = weights[k + 1] = length <= huber_px ? 1.0 : huber_px / length;
  }
  const MatrixXd weighted_lens = weights.asDiagonal() * by_lens;
  const MatrixXd weighted_pose = weights.asDiagonal() * by_pose;
  return {by_lens.transpose() * weighted_lens,   by_lens.transpose() * weighted_pose,
          by_pose.transpose() * weighted_pose,   weighted_lens.transpose() * residuals,
          weighted_pose.transpose() * residuals, residuals.dot(weights.cwiseProduct(residuals))};
}

double LensProblem::Cost(const std::vector<const BoardView*>& views, double huber_px,
                         const State& state) const {
  double cost = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const VectorXd residuals = Residuals(state.lens, state.poses[v], *views[v], nullptr, nullptr);
    for (Eigen::Index k = 0; k < residuals.size(); k += 2) {
      cost += HuberCost(residuals.segment<2>(k).norm(), huber_px);
    }
  }
  return std::isfinite(cost) ? cost : 1e300;
}

LensProblem::State LensProblem::Stepped(const State& state, const std::vector<Normal>& normals,
                                        const std::vector<bool>& free, double damping) const {
  MatrixXd reduced = MatrixXd::Zero(parameters(), parameters());
  VectorXd right = VectorXd::Zero(parameters());
  std::vector<Eigen::LDLT<Eigen::Matrix<double, 6, 6>>> solvers;
  for (const Normal& normal : normals) {
    Eigen::Matrix<double, 6, 6> pose_pose = normal.pose_pose;
    pose_pose.diagonal() *= 1 + damping;
    solvers.emplace_back(pose_pose);
    MatrixXd lens_lens = normal.lens_lens;
    lens_lens.diagonal() *= 1 + damping;
    reduced += lens_lens - normal.lens_pose * solvers.back().solve(normal.lens_pose.transpose());
    right += normal.lens_gradient - normal.lens_pose * solvers.back().solve(normal.pose_gradient);
  }
  for (int k = 0; k < parameters(); ++k) {
    if (!free[k]) reduced(k, k) = 1;  // its step is nothing
  }
  const VectorXd step = -reduced.ldlt().solve(right);
  State next = state;
  next.lens += step;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    next.poses[v] -=
        solvers[v].solve(normals[v].pose_gradient + normals[v].lens_pose.transpose() * step);
  }
  return next;
}

void LensProblem::Minimise(const std::vector<const BoardView*>& views,
                           const std::vector<bool>& free, double huber_px, int iterations,
                           State& state) const {
  double damping = 1e-3;
  state.cost = Cost(views, huber_px, state);
  for (int iteration = 0; iteration < iterations && !stop_.stop_requested(); ++iteration) {
    std::vector<Normal> normals;
    for (std::size_t v = 0; v < views.size(); ++v) {
      normals.push_back(Accumulate(state.lens, state.poses[v], *views[v], free, huber_px));
    }
    bool better = false;
    double gain = 0;
    for (; !better && damping < 1e9; damping *= better ? 0.1 : 10) {
      State next = Stepped(state, normals, free, damping);
      next.cost = next.lens[0] > 0 && next.lens[1] > 0 ? Cost(views, huber_px, next) : 1e300;
      better = next.cost < state.cost;
      if (!better) continue;
      gain = (state.cost - next.cost) / state.cost;
      state = std::move(next);
    }
    if (!better || gain < 1e-10) return;
  }
}

MatrixXd LensProblem::Covariance(const std::vector<const BoardView*>& views, double huber_px,
                                 const State& state) const {
  const int n = parameters();
  const std::vector<bool> all(n, true);
  MatrixXd reduced = MatrixXd::Zero(n, n), spread = MatrixXd::Zero(n, n);
  double squares = 0;
  int measured = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Normal normal = Accumulate(state.lens, state.poses[v], *views[v], all, huber_px);
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> pose(normal.pose_pose);
    reduced += normal.lens_lens - normal.lens_pose * pose.solve(normal.lens_pose.transpose());
    const VectorXd pull =
        normal.lens_gradient - normal.lens_pose * pose.solve(normal.pose_gradient);
    spread += pull * pull.transpose();
    squares += normal.weighted_squares;
    measured += 2 * static_cast<int>(views[v]->corners.size()) - 6;
  }
  const MatrixXd inverse = reduced.ldlt().solve(MatrixXd::Identity(n, n));
  MatrixXd corners = squares / std::max(1, measured - n) * inverse;
  // Corners of one view err together (a bent board, blur): views are what is independent.
  const double count = static_cast<double>(views.size());
  const MatrixXd by_view = count / std::max(1.0, count - n) * inverse * spread * inverse;
  for (int k = 0; k < n; ++k) corners(k, k) = std::max(corners(k, k), by_view(k, k));
  return corners;
}

}  // namespace saccade
