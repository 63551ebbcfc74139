#include "server/map/start_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/map/bundle_costs.hpp"
#include "server/map/start_evidence.hpp"
#include "server/map/start_guess.hpp"

namespace saccade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kBehind = 1e-3;     // cosine below which a ray is not seen
constexpr double kLossSigmas = 1.0;  // matches' sigmas are set with a margin
constexpr double kRangeShare = 2.0;  // sigma of the guess of an inverse range, of the median
constexpr int kIterations = 30;
constexpr int kFewestStartPoints = 12, kFewestStartKeyframes = 3;

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

struct SightingCost {
  RayError error;
  BearingOf bearing;

  template <typename T>
  bool operator()(const T* camera, const T* anchor, const T* point, const T* readout,
                  T* residual) const {
    return error(DirectionIn(camera, anchor, point, bearing), readout, residual);
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

/// The problem as Ceres sees it; blocks keep their addresses.
class Adjustment {
 public:
  explicit Adjustment(const StartProblem& start) : start_(start), readout_(start.readout_s) {
    for (const Rigid3& pose : start.world_from_camera) {
      poses_.push_back(Pack(pose));
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
    // A group of its own: within one the order is that of addresses, and results would hang on it.
    options.linear_solver_ordering->AddElementToGroup(&readout_, 2);
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
      found.world_from_camera[k] = Unpack(poses_[k]);
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
    const auto best =
        std::min_element(attempts.begin(), attempts.end(),
                         [](const Attempt& a, const Attempt& b) { return a.cost < b.cost; });
    if (const auto other = OtherPlane(best->found)) from(*other);
  }
  return attempts;
}

}  // namespace

std::optional<StartSolution> SolveStart(const StartProblem& problem,
                                        const std::atomic<bool>& stop) {
  if (std::ssize(problem.world_from_camera) < kFewestStartKeyframes ||
      std::ssize(problem.points) < kFewestStartPoints || problem.sightings.empty()) {
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

}  // namespace saccade
