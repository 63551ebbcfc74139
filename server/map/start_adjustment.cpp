#include "server/map/start_adjustment.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "server/filter/point_model.hpp"
#include "server/map/start_guess.hpp"

namespace saccade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kBehind = 1e-3;      // cosine below which a ray is not seen
constexpr double kLossSigmas = 1.0;   // matches' sigmas are set with a margin
constexpr double kRangeShare = 2.0;   // sigma of the guess of an inverse range, of the median
constexpr double kKnownShare = 0.25;  // sigma / inverse range of a point that counts as known
constexpr double kAgreeSigmas = 3.0;
constexpr int kIterations = 30;
constexpr int kFewestPoints = 12, kFewestKeyframes = 3;

template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

using PoseBlock = std::array<double, 7>;   // [x y z w | translation]
using PointBlock = std::array<double, 3>;  // [tangent u v | inverse range]

/// Tangent coordinates of a direction (any length) around a measured ray, in sigmas.
struct RayError {
  explicit RayError(const StartRay& measured)
      : seen(measured), weighted_basis(TangentBasis(measured.ray) / measured.sigma_rad) {}

  template <typename T>
  bool operator()(const Vec3<T>& direction, const T* readout, T* residual) const {
    const T along = direction.dot(seen.ray.cast<T>());
    if (along < T(kBehind) * direction.norm()) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> error(residual);
    error = weighted_basis.cast<T>().transpose() *
            (direction / along - seen.d_readout.cast<T>() * *readout);
    return true;
  }

  StartRay seen;
  Eigen::Matrix<double, 3, 2> weighted_basis;
};

struct BearingOf {
  Vector3d bearing;
  Eigen::Matrix<double, 3, 2> basis;

  template <typename T>
  Vec3<T> operator()(const T* point) const {
    const Vec3<T> moved =
        bearing.cast<T>() + basis.col(0).cast<T>() * point[0] + basis.col(1).cast<T>() * point[1];
    return moved.normalized();
  }
};

struct SightingCost {
  RayError error;
  BearingOf bearing;

  template <typename T>
  bool operator()(const T* camera, const T* anchor, const T* point, const T* readout,
                  T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> turn_camera(camera), turn_anchor(anchor);
    const Eigen::Map<const Vec3<T>> at_camera(camera + 4), at_anchor(anchor + 4);
    const Vec3<T> in_world = turn_anchor * bearing(point) + point[2] * (at_anchor - at_camera);
    return error(Vec3<T>(turn_camera.conjugate() * in_world), readout, residual);
  }
};

struct BirthCost {
  RayError error;
  BearingOf bearing;
  double inverse_range, sigma;

  template <typename T>
  bool operator()(const T* point, const T* readout, T* residual) const {
    residual[2] = (point[2] - T(inverse_range)) / T(sigma);
    return error(bearing(point), readout, residual);
  }
};

struct ReadoutCost {
  double mean, sigma;
  template <typename T>
  bool operator()(const T* readout, T* residual) const {
    residual[0] = (*readout - T(mean)) / T(sigma);
    return true;
  }
};

class Stopper : public ceres::IterationCallback {
 public:
  explicit Stopper(const std::atomic<bool>& stop) : stop_(stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return stop_ ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::atomic<bool>& stop_;
};

/// The problem as Ceres sees it; blocks keep their addresses.
class Adjustment {
 public:
  explicit Adjustment(const StartProblem& start) : start_(start), readout_(start.readout_s) {
    for (const Rigid3& pose : start.world_from_camera) {
      PoseBlock& block = poses_.emplace_back();
      Eigen::Map<Eigen::Quaterniond>(block.data()) = pose.rotation;
      Eigen::Map<Vector3d>(block.data() + 4) = pose.translation;
    }
    for (const StartPoint& point : start.points) {
      points_.push_back({0.0, 0.0, point.inverse_range});
      bearings_.push_back({point.bearing, TangentBasis(point.bearing)});
    }
    AddResiduals();
    Constrain();
  }

  /// The cost where it ends; nothing: no solution.
  std::optional<double> Solve(const std::atomic<bool>& stop) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (PointBlock& point : points_)
      options.linear_solver_ordering->AddElementToGroup(point.data(), 0);
    for (PoseBlock& pose : poses_)
      options.linear_solver_ordering->AddElementToGroup(pose.data(), 1);
    options.linear_solver_ordering->AddElementToGroup(&readout_, 1);
    options.max_num_iterations = kIterations;
    options.function_tolerance = 1e-5;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    Stopper stopper(stop);
    options.callbacks.push_back(&stopper);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable() || stop) return std::nullopt;
    return summary.final_cost;
  }

  StartProblem Estimates() const {
    StartProblem found = start_;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      found.world_from_camera[k] = {
          Eigen::Map<const Eigen::Quaterniond>(poses_[k].data()).normalized(),
          Eigen::Map<const Vector3d>(poses_[k].data() + 4)};
    }
    for (std::size_t k = 0; k < points_.size(); ++k) {
      found.points[k].bearing = bearings_[k](points_[k].data());
      found.points[k].inverse_range = points_[k][2];
    }
    found.readout_s = readout_;
    return found;
  }

  /// Information of [read-out | keyframes | points] by the errors of StartSolution, and residuals.
  MatrixXd Information(Eigen::VectorXd& residuals) {
    ceres::Problem::EvaluateOptions options;
    options.apply_loss_function = true;
    options.parameter_blocks.push_back(&readout_);
    for (PoseBlock& pose : poses_) options.parameter_blocks.push_back(pose.data());
    for (PointBlock& point : points_) options.parameter_blocks.push_back(point.data());
    ceres::CRSMatrix crs;
    std::vector<double> values;
    problem_.Evaluate(options, nullptr, &values, nullptr, &crs);
    residuals = Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values));
    MatrixXd information = MatrixXd::Zero(crs.num_cols, crs.num_cols);
    for (int row = 0; row < crs.num_rows; ++row) {
      for (int a = crs.rows[row]; a < crs.rows[row + 1]; ++a) {
        for (int b = crs.rows[row]; b <= a; ++b) {
          information(crs.cols[a], crs.cols[b]) += crs.values[a] * crs.values[b];
        }
      }
    }
    return information.selfadjointView<Eigen::Lower>();
  }

  const std::vector<BearingOf>& bearings() const { return bearings_; }

 private:
  void AddResiduals() {
    std::vector<double> ranges;
    for (const StartPoint& point : start_.points) ranges.push_back(point.inverse_range);
    std::nth_element(ranges.begin(), ranges.begin() + std::ssize(ranges) / 2, ranges.end());
    const double median = ranges[ranges.size() / 2];
    for (std::size_t k = 0; k < points_.size(); ++k) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<BirthCost, 3, 3, 1>(new BirthCost{
              RayError(start_.points[k].seen), bearings_[k], median, kRangeShare * median}),
          nullptr, points_[k].data(), &readout_);
    }
    for (const StartSighting& sighting : start_.sightings) {
      double* camera = poses_[static_cast<std::size_t>(sighting.keyframe)].data();
      const auto index = static_cast<std::size_t>(sighting.point);
      double* anchor = poses_[static_cast<std::size_t>(start_.points[index].anchor)].data();
      const SightingCost cost{RayError(sighting.seen), bearings_[index]};
      double residual[2];
      if (!cost(camera, anchor, points_[index].data(), &readout_, residual)) continue;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<SightingCost, 2, 7, 7, 3, 1>(new SightingCost(cost)),
          new ceres::CauchyLoss(kLossSigmas), camera, anchor, points_[index].data(), &readout_);
    }
    for (PoseBlock& pose : poses_) problem_.AddParameterBlock(pose.data(), 7);
    constexpr double kHeld = 1e-9;  // where it is known
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<ReadoutCost, 1, 1>(new ReadoutCost{
                                  start_.readout_s, std::max(kHeld, start_.readout_sigma_s)}),
                              nullptr, &readout_);
  }

  void Constrain() {
    using PoseManifold =
        ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
    for (PoseBlock& pose : poses_) problem_.SetManifold(pose.data(), new PoseManifold);
    problem_.SetParameterBlockConstant(poses_.front().data());
  }

  const StartProblem& start_;
  std::vector<PoseBlock> poses_;
  std::vector<PointBlock> points_;
  std::vector<BearingOf> bearings_;
  double readout_;
  ceres::Problem problem_;
};

/// From Ceres' errors (half turns in the world, tangents of the first bearings) to ours.
MatrixXd ToOurErrors(const StartProblem& found, const std::vector<BearingOf>& bearings,
                     const MatrixXd& covariance) {
  const auto keyframes = std::ssize(found.world_from_camera);
  MatrixXd j = MatrixXd::Zero(covariance.rows(), covariance.rows());
  j(0, 0) = 1.0;
  for (Eigen::Index k = 0; k < keyframes; ++k) {
    const Rigid3& pose = found.world_from_camera[static_cast<std::size_t>(k)];
    j.block<3, 3>(1 + 6 * k, 1 + 6 * k + 3).setIdentity();
    j.block<3, 3>(1 + 6 * k + 3, 1 + 6 * k) = 2.0 * pose.RotationMatrix().transpose();
  }
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = 1 + 6 * keyframes + 3 * static_cast<Eigen::Index>(k);
    j.block<2, 2>(at, at) = TangentBasis(found.points[k].bearing).transpose() * bearings[k].basis;
    j(at + 2, at + 2) = 1.0;
  }
  return j * covariance * j.transpose();
}

/// The scale direction is taken out: what it would do to the inverse ranges on the whole is held.
void HoldScale(const StartProblem& found, MatrixXd& information) {
  const Eigen::Index first = 1 + 6 * std::ssize(found.world_from_camera);
  Eigen::VectorXd row = Eigen::VectorXd::Zero(information.rows());
  double total = 0.0;
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = first + 3 * static_cast<Eigen::Index>(k) + 2;
    const double rho = found.points[k].inverse_range;
    if (rho <= 0.0) continue;
    row[at] = rho * information(at, at);
    total += rho * rho * information(at, at);
  }
  if (total <= 0.0) return;
  constexpr double kHeld = 1e-5;  // relative sigma
  row /= total * kHeld;
  information += row * row.transpose();
}

StartEvidence Weigh(const StartProblem& found, const MatrixXd& covariance,
                    const Eigen::VectorXd& residuals) {
  StartEvidence evidence;
  const Eigen::Index keyframes = std::ssize(found.world_from_camera);
  for (Eigen::Index k = 1; k < keyframes; ++k) {
    for (Eigen::Index l = 0; l < k; ++l) {
      const Vector3d way = found.world_from_camera[static_cast<std::size_t>(k)].translation -
                           found.world_from_camera[static_cast<std::size_t>(l)].translation;
      const double squared = way.squaredNorm();
      if (squared <= 0.0) continue;
      const auto block = [&](Eigen::Index a, Eigen::Index b) {
        return way.dot(covariance.block<3, 3>(1 + 6 * a, 1 + 6 * b) * way) / squared;
      };
      const double variance = (block(k, k) + block(l, l) - 2.0 * block(k, l)) / squared;
      evidence.scale_sigma = std::min(evidence.scale_sigma, std::sqrt(std::max(0.0, variance)));
    }
  }
  for (std::size_t k = 0; k < found.points.size(); ++k) {
    const Eigen::Index at = 1 + 6 * keyframes + 3 * static_cast<Eigen::Index>(k) + 2;
    const double rho = found.points[k].inverse_range;
    evidence.known_points +=
        rho > 0.0 && covariance(at, at) < kKnownShare * kKnownShare * rho * rho ? 1 : 0;
  }
  const Eigen::Index from = 3 * std::ssize(found.points);
  const Eigen::Index count = (residuals.size() - from) / 2;
  Eigen::Index agree = 0;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double squared = residuals.segment<2>(from + 2 * k).squaredNorm();
    // The loss has been applied: |r|^2 as it counts.
    const double plain = std::expm1(std::min(50.0, squared));
    agree += plain < kAgreeSigmas * kAgreeSigmas ? 1 : 0;
    sum += std::min(plain, kAgreeSigmas * kAgreeSigmas);
  }
  if (count == 0) return evidence;
  evidence.agreeing = static_cast<double>(agree) / static_cast<double>(count);
  const double unknowns = 6.0 * static_cast<double>(keyframes - 1) + std::ssize(found.points);
  evidence.noise = std::sqrt(sum / std::max(1.0, 2.0 * static_cast<double>(count) - unknowns));
  return evidence;
}

struct Attempt {
  std::unique_ptr<StartProblem> guess;  // what the adjustment was made of
  std::unique_ptr<Adjustment> adjustment;
  double cost = 0.0;
  StartProblem found;
};

std::vector<Attempt> Attempts(const StartProblem& problem, const std::atomic<bool>& stop) {
  std::vector<Attempt> attempts;
  const auto from = [&](StartProblem guess) {
    Attempt attempt;
    attempt.guess = std::make_unique<StartProblem>(std::move(guess));
    attempt.adjustment = std::make_unique<Adjustment>(*attempt.guess);
    const auto cost = attempt.adjustment->Solve(stop);
    if (!cost) return;
    attempt.cost = *cost;
    attempt.found = attempt.adjustment->Estimates();
    attempts.push_back(std::move(attempt));
  };
  from(problem);
  from(GuessTurns(problem));
  if (!attempts.empty()) {
    const bool last = attempts.back().cost < attempts.front().cost;
    from(Reversed(last ? attempts.back().found : attempts.front().found));
  }
  return attempts;
}

/// Whether the camera goes the same way in both.
bool GoAlike(const StartProblem& a, const StartProblem& b) {
  constexpr double kCosine = 0.7;
  const auto way = [](const StartProblem& found) {
    return Vector3d(found.world_from_camera.back().translation -
                    found.world_from_camera.front().translation);
  };
  return way(a).dot(way(b)) > kCosine * way(a).norm() * way(b).norm();
}

}  // namespace

std::optional<StartSolution> SolveStart(const StartProblem& problem,
                                        const std::atomic<bool>& stop) {
  if (std::ssize(problem.world_from_camera) < kFewestKeyframes ||
      std::ssize(problem.points) < kFewestPoints || problem.sightings.empty()) {
    return std::nullopt;
  }
  const std::vector<Attempt> attempts = Attempts(problem, stop);
  if (attempts.empty() || stop) return std::nullopt;
  const auto chosen =
      std::min_element(attempts.begin(), attempts.end(),
                       [](const Attempt& a, const Attempt& b) { return a.cost < b.cost; });
  StartSolution solution;
  solution.problem = chosen->found;
  Eigen::VectorXd residuals;
  MatrixXd information = chosen->adjustment->Information(residuals);
  HoldScale(solution.problem, information);
  // What was held has no rows of information: its errors are zero, not unknown.
  for (Eigen::Index k = 0; k < information.rows(); ++k) {
    if (information(k, k) <= 0.0) information(k, k) = 1e18;
  }
  const Eigen::LDLT<MatrixXd> factor(information);
  if (factor.info() != Eigen::Success || stop) return std::nullopt;
  const MatrixXd covariance =
      factor.solve(MatrixXd::Identity(information.rows(), information.rows()));
  if (!covariance.allFinite()) return std::nullopt;
  solution.covariance = ToOurErrors(solution.problem, chosen->adjustment->bearings(), covariance);
  solution.evidence = Weigh(solution.problem, solution.covariance, residuals);
  for (const Attempt& other : attempts) {
    if (GoAlike(other.found, solution.problem)) continue;
    solution.evidence.margin = std::min(solution.evidence.margin, other.cost - chosen->cost);
  }
  return solution;
}

void ScaleTo(double range, StartSolution& solution) {
  StartProblem& found = solution.problem;
  std::vector<double> all;
  for (const StartPoint& point : found.points) all.push_back(point.inverse_range);
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  const double median = all[all.size() / 2];
  if (median <= 0.0) return;
  const double scale = range * median;  // of lengths
  const Vector3d origin = found.world_from_camera.front().translation;
  Eigen::VectorXd by = Eigen::VectorXd::Ones(solution.covariance.rows());
  Eigen::Index at = 1;
  for (Rigid3& pose : found.world_from_camera) {
    pose.translation = origin + scale * (pose.translation - origin);
    by.segment<3>(at).setConstant(scale);
    at += 6;
  }
  for (StartPoint& point : found.points) {
    point.inverse_range /= scale;
    by[at + 2] = 1.0 / scale;
    at += 3;
  }
  solution.covariance = by.asDiagonal() * solution.covariance * by.asDiagonal();
}

}  // namespace saccade
