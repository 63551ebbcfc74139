#include "server/filter/robust_pose.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace saccade {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

namespace {

constexpr double kMedianOfRayleigh = 1.1774;  // median of the distance of a 2-D unit normal

Rigid3 Moved(const Rigid3& pose, const Vector6d& step) {
  return {(pose.rotation * ExpQuaternion(step.tail<3>())).normalized(),
          pose.translation + step.head<3>()};
}

Vector6d Step(const Rigid3& from, const Rigid3& to) {
  Vector6d step;
  step << to.translation - from.translation, LogQuaternion(from.rotation.conjugate() * to.rotation);
  return step;
}

/// One match, linearised: residual = z - h - d_pose * step.
struct Line {
  Vector2d residual;
  Matrix26d d_pose;
  Matrix2d weight;    // inverse covariance of the residual given the pose
  double vote = 0.0;  // how much it can say of the pose, 0 to 1: noise alone against everything
  bool valid = false;
};

class Problem {
 public:
  Problem(const CameraModel& camera, const PosePrior& prior, std::span<const PoseEvidence> evidence)
      : camera_(camera), prior_(prior), factor_(prior.covariance), evidence_(evidence) {
    information_ = factor_.solve(Matrix6d::Identity());
    lines_.resize(evidence.size());
    distances_.resize(evidence.size());
  }

  /// Residuals and Jacobians at prior [+] step, Jacobians by the step from the prior.
  void Linearise(const Vector6d& step) {
    const Rigid3 pose = Moved(prior_.world_from_camera, step);
    const Eigen::Matrix3d turn = RightJacobianSo3(step.tail<3>());
    for (std::size_t k = 0; k < evidence_.size(); ++k) {
      const PoseEvidence& match = evidence_[k];
      Line& line = lines_[k];
      const auto at = PixelGivenPose(camera_, prior_, factor_, match.point, match.predicted, pose);
      line.valid = at.has_value();
      if (!at) continue;
      line.residual = match.pixel - at->pixel;
      line.d_pose = at->d_pose;
      line.d_pose.rightCols<3>() = at->d_pose.rightCols<3>() * turn;
      line.weight = (at->covariance + match.noise).inverse();
      line.vote = std::sqrt(std::max(0.0, match.noise.determinant() * line.weight.determinant()));
    }
  }

  /// Squared Mahalanobis distances `step` away from where the lines were made.
  const std::vector<double>& Distances(const Vector6d& step) {
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      const Line& line = lines_[k];
      if (!line.valid) {
        distances_[k] = 1e12;
        continue;
      }
      const Vector2d error = line.residual - line.d_pose * step;
      distances_[k] = error.dot(line.weight * error);
    }
    return distances_;
  }

  /// Step of the best single match, or none: the prior itself is a hypothesis too.
  Vector6d BestOfOne(const RobustPoseOptions& options, std::mt19937_64& random) {
    Vector6d best = Vector6d::Zero();
    double best_votes = Agreeing(best, options);
    const double all_votes =
        std::accumulate(lines_.begin(), lines_.end(), 0.0,
                        [](double sum, const Line& line) { return sum + line.vote; });
    std::vector<int> order(lines_.size());
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random() % k]);
    double needed = options.max_hypotheses;
    for (std::size_t k = 0; k < order.size() && static_cast<double>(k) < needed; ++k) {
      const Line& line = lines_[order[k]];
      if (!line.valid) continue;
      const Eigen::Matrix<double, 6, 2> gain = prior_.covariance * line.d_pose.transpose();
      const Matrix2d s = line.d_pose * gain + line.weight.inverse();
      const Vector6d step = gain * s.inverse() * line.residual;
      const double votes = Agreeing(step, options);
      if (votes <= best_votes) continue;
      best_votes = votes;
      best = step;
      const double bad = 1.0 - votes / all_votes;
      needed = bad < 1e-3 ? 1.0 : std::log(0.01) / std::log(bad);
    }
    return best;
  }

  /// One weighted Gauss-Newton step from `step`; false if singular.
  bool Improve(double cutoff, Vector6d& step, Matrix6d& covariance) {
    Linearise(step);
    Matrix6d normal = information_;
    Vector6d pulled = -information_ * step;
    const std::vector<double>& distances = Distances(Vector6d::Zero());
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      const double weight = Weight(distances[k], cutoff);
      if (weight <= 0.0) continue;
      const Eigen::Matrix<double, 6, 2> side =
          weight * lines_[k].d_pose.transpose() * lines_[k].weight;
      normal += side * lines_[k].d_pose;
      pulled += side * lines_[k].residual;
    }
    const Eigen::LLT<Matrix6d> factor(normal);
    if (factor.info() != Eigen::Success) return false;
    const Vector6d move = factor.solve(pulled);
    if (!move.allFinite()) return false;
    step += move;
    covariance = factor.solve(Matrix6d::Identity());
    return true;
  }

  static double Weight(double squared_distance, double cutoff) {
    const double ratio = squared_distance / (cutoff * cutoff);
    return ratio >= 1.0 ? 0.0 : (1.0 - ratio) * (1.0 - ratio);
  }

  /// Median by votes: features of unknown depth are near by being vague.
  double MedianDistance(const Vector6d& step) {
    const std::vector<double>& distances = Distances(step);
    std::vector<std::pair<double, double>> sorted;  // distance, vote
    double half = 0.0;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      if (!lines_[k].valid) continue;
      sorted.emplace_back(distances[k], lines_[k].vote);
      half += 0.5 * lines_[k].vote;
    }
    std::sort(sorted.begin(), sorted.end());
    for (const auto& [distance, vote] : sorted) {
      half -= vote;
      if (half <= 0.0) return std::sqrt(distance);
    }
    return 0.0;
  }

 private:
  double Agreeing(const Vector6d& step, const RobustPoseOptions& options) {
    const std::vector<double>& distances = Distances(step);
    double votes = 0.0;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      if (distances[k] < options.agree_chi2) votes += lines_[k].vote;
    }
    return votes;
  }

  const CameraModel& camera_;
  const PosePrior& prior_;
  Eigen::LLT<Matrix6d> factor_;
  Matrix6d information_;
  std::span<const PoseEvidence> evidence_;
  std::vector<Line> lines_;
  std::vector<double> distances_;
};

}  // namespace

std::optional<ConditionalPixel> PixelGivenPose(const CameraModel& camera, const PosePrior& prior,
                                               const Eigen::LLT<Matrix6d>& prior_factor,
                                               const std::variant<PointFromClone, Vector3d>& point,
                                               const PredictedPixel& predicted,
                                               const Rigid3& pose) {
  const auto at = std::holds_alternative<PointFromClone>(point)
                      ? PredictFromClone(camera, pose, std::get<PointFromClone>(point))
                      : PredictFixed(camera, pose, std::get<Vector3d>(point));
  if (!at) return std::nullopt;
  // E[pixel error | pose error] = Cov(pixel, pose) P^-1 pose error: the part beyond the pose's own
  // Jacobian is the map moving along.
  const Matrix26d total = prior_factor.solve(predicted.with_camera.transpose()).transpose();
  const Matrix26d along = total - predicted.at.d_camera;
  ConditionalPixel result;
  result.pixel = at->pixel + along * Step(prior.world_from_camera, pose);
  const Matrix2d rest = predicted.covariance - total * predicted.with_camera.transpose();
  result.covariance = 0.5 * (rest + rest.transpose());
  result.d_pose = at->d_camera + along;
  return result;
}

RobustPose EstimateRobustPose(const CameraModel& camera, const PosePrior& prior,
                              std::span<const PoseEvidence> evidence,
                              const RobustPoseOptions& options, std::mt19937_64& random) {
  RobustPose result{prior.world_from_camera, prior.covariance, {}, {}, 1.0, 0};
  if (evidence.empty()) return result;
  Problem problem(camera, prior, evidence);
  problem.Linearise(Vector6d::Zero());
  Vector6d step = problem.BestOfOne(options, random);
  double scale = std::max(1.0, problem.MedianDistance(step) / kMedianOfRayleigh);
  result.scale = scale;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    const Vector6d before = step;
    if (!problem.Improve(options.cutoff * scale, step, result.covariance)) break;
    const bool settled = (step - before).cwiseAbs().maxCoeff() < 1e-7;
    if (settled && scale == 1.0) break;
    scale = std::max(1.0, 0.5 * scale);
  }
  result.world_from_camera = Moved(prior.world_from_camera, step);
  problem.Linearise(step);
  result.squared_distances = problem.Distances(Vector6d::Zero());
  result.weights.reserve(evidence.size());
  for (const double distance : result.squared_distances) {
    result.weights.push_back(Problem::Weight(distance, options.cutoff));
    result.inliers += result.weights.back() > 0.1 ? 1 : 0;
  }
  return result;
}

}  // namespace saccade
