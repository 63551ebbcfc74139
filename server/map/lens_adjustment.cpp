#include "server/map/lens_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/map/lens_costs.hpp"

namespace saccade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLossSigmas = 1.0;  // as in the other adjustments: sigmas are set with a margin
constexpr double kRangeShare = 1.0;  // of an inverse range, that nothing tells of
constexpr double kCut_px = 3.0;      // residuals count as no more in the root mean square
constexpr int kIterations = 25;
constexpr int kFewestKeyframes = 6, kFewestSightings = 150;

LensMatrix RootOf(const LensMatrix& covariance) {
  return Eigen::LLT<LensMatrix>(covariance.inverse()).matrixU();
}

using LensBlock = std::array<double, kLensSize>;

/// The problem as Ceres sees it; blocks keep their addresses.
class Adjustment {
 public:
  explicit Adjustment(const LensBundle& start) : start_(start) {
    Eigen::Map<LensVector>(lens_.data()) = start.lens;
    for (const Rigid3& pose : start.world_from_camera) poses_.push_back(Pack(pose));
    for (const LensBundle::Point& point : start.points) {
      points_.push_back({0.0, 0.0, point.inverse_range});
      bearings_.push_back({point.bearing, TangentBasis(point.bearing)});
    }
    AddResiduals();
    for (PoseBlock& pose : poses_) {
      if (problem_.HasParameterBlock(pose.data())) {
        problem_.SetManifold(pose.data(), new PoseManifold);
      }
    }
    if (start.known.empty() && problem_.HasParameterBlock(poses_.front().data())) {
      problem_.SetParameterBlockConstant(poses_.front().data());
    }
  }

  bool Solve(const std::atomic<bool>& stop) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto add = [&](double* block, int group) {
      if (problem_.HasParameterBlock(block)) {
        options.linear_solver_ordering->AddElementToGroup(block, group);
      }
    };
    for (PointBlock& point : points_) add(point.data(), 0);
    for (PoseBlock& pose : poses_) add(pose.data(), 1);
    add(lens_.data(), 2);  // a group of its own: the order within one is that of addresses
    options.max_num_iterations = kIterations;
    options.function_tolerance = 1e-5;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    Stopper stopper(stop);
    options.callbacks.push_back(&stopper);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable() && !stop;
  }

  LensBundle Estimates() const {
    LensBundle found = start_;
    found.lens = Eigen::Map<const LensVector>(lens_.data());
    for (std::size_t k = 0; k < poses_.size(); ++k) found.world_from_camera[k] = Unpack(poses_[k]);
    for (std::size_t k = 0; k < points_.size(); ++k) {
      found.points[k].bearing = bearings_[k](points_[k].data());
      found.points[k].inverse_range = points_[k][2];
    }
    return found;
  }

  /// Of the pixels, without the loss; each at most kCut_px.
  double Rms_px() {
    ceres::Problem::EvaluateOptions options;
    options.apply_loss_function = false;
    options.residual_blocks = pixels_;
    std::vector<double> values;
    problem_.Evaluate(options, nullptr, &values, nullptr, nullptr);
    double sum = 0.0;
    for (std::size_t k = 0; k < pixels_.size(); ++k) {
      const double px = std::hypot(values[2 * k], values[2 * k + 1]) * sigmas_px_[k];
      sum += std::min(px, kCut_px) * std::min(px, kCut_px);
    }
    return pixels_.empty() ? 0.0 : std::sqrt(sum / (2.0 * static_cast<double>(pixels_.size())));
  }
  int observations() const { return static_cast<int>(pixels_.size()); }

  /// Of the lens, all else eliminated. Nothing: not determined.
  std::optional<LensMatrix> Covariance();

 private:
  void AddResiduals() {
    problem_.AddParameterBlock(lens_.data(), kLensSize);
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<LensPriorCost, kLensSize, kLensSize>(
                                  new LensPriorCost{start_.prior, RootOf(start_.prior_covariance)}),
                              nullptr, lens_.data());
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const LensBundle::Point& point = start_.points[k];
      const LensBirthCost cost{{point.seen, point.sigma_px},
                               bearings_[k],
                               point.inverse_range,
                               kRangeShare * std::max(1e-3, std::abs(point.inverse_range))};
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<LensBirthCost, 3, kLensSize, 3>(new LensBirthCost(cost)),
          nullptr, lens_.data(), points_[k].data());
    }
    const auto keep = [this](ceres::ResidualBlockId id, double sigma_px) {
      pixels_.push_back(id);
      sigmas_px_.push_back(sigma_px);
    };
    double residual[2];
    for (const LensBundle::Sighting& sighting : start_.sightings) {
      const auto index = static_cast<std::size_t>(sighting.point);
      double* camera = poses_[static_cast<std::size_t>(sighting.keyframe)].data();
      double* anchor = poses_[static_cast<std::size_t>(start_.points[index].anchor)].data();
      double* point = points_[index].data();
      const LensSightingCost cost{{sighting.pixel, sighting.sigma_px}, bearings_[index]};
      // What is behind a camera to begin with would end the whole adjustment.
      if (camera == anchor || !cost(lens_.data(), camera, anchor, point, residual)) continue;
      keep(problem_.AddResidualBlock(
               new ceres::AutoDiffCostFunction<LensSightingCost, 2, kLensSize, 7, 7, 3>(
                   new LensSightingCost(cost)),
               new ceres::CauchyLoss(kLossSigmas), lens_.data(), camera, anchor, point),
           sighting.sigma_px);
    }
    for (const LensBundle::KnownSighting& sighting : start_.known) {
      double* camera = poses_[static_cast<std::size_t>(sighting.keyframe)].data();
      const LensKnownCost cost{{sighting.pixel, sighting.sigma_px}, sighting.point_in_world};
      if (!cost(lens_.data(), camera, residual)) continue;
      keep(
          problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<LensKnownCost, 2, kLensSize, 7>(
                                        new LensKnownCost(cost)),
                                    new ceres::CauchyLoss(kLossSigmas), lens_.data(), camera),
          sighting.sigma_px);
    }
  }

  const LensBundle& start_;
  LensBlock lens_;
  std::vector<PoseBlock> poses_;
  std::vector<PointBlock> points_;
  std::vector<BearingOf> bearings_;
  std::vector<ceres::ResidualBlockId> pixels_;
  std::vector<double> sigmas_px_;
  ceres::Problem problem_;
};

std::optional<LensMatrix> Adjustment::Covariance() {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks.push_back(lens_.data());
  for (PoseBlock& pose : poses_) {
    if (problem_.HasParameterBlock(pose.data())) options.parameter_blocks.push_back(pose.data());
  }
  const int cameras = kLensSize + 6 * (static_cast<int>(options.parameter_blocks.size()) - 1);
  for (PointBlock& point : points_) options.parameter_blocks.push_back(point.data());
  ceres::CRSMatrix crs;
  if (!problem_.Evaluate(options, nullptr, nullptr, nullptr, &crs)) return std::nullopt;
  // Each row knows of one point at most, which comes last.
  std::vector<std::vector<int>> rows_of(points_.size());
  MatrixXd information = MatrixXd::Zero(cameras, cameras);
  for (int row = 0; row < crs.num_rows; ++row) {
    const int end = crs.rows[row + 1];
    for (int a = crs.rows[row]; a < end && crs.cols[a] < cameras; ++a) {
      for (int b = crs.rows[row]; b < end && crs.cols[b] < cameras; ++b) {
        information(crs.cols[a], crs.cols[b]) += crs.values[a] * crs.values[b];
      }
    }
    if (end > crs.rows[row] && crs.cols[end - 1] >= cameras) {
      rows_of[static_cast<std::size_t>((crs.cols[end - 1] - cameras) / 3)].push_back(row);
    }
  }
  std::vector<int> place(static_cast<std::size_t>(cameras), -1), columns;
  for (std::size_t point = 0; point < rows_of.size(); ++point) {
    const int first = cameras + 3 * static_cast<int>(point);
    columns.clear();
    Eigen::Matrix3d v = Eigen::Matrix3d::Zero();
    Eigen::Matrix3Xd w = Eigen::Matrix3Xd::Zero(3, cameras);
    for (const int row : rows_of[point]) {
      Vector3d own = Vector3d::Zero();
      for (int a = crs.rows[row]; a < crs.rows[row + 1]; ++a) {
        if (crs.cols[a] >= first) own[crs.cols[a] - first] = crs.values[a];
      }
      v += own * own.transpose();
      for (int a = crs.rows[row]; a < crs.rows[row + 1] && crs.cols[a] < cameras; ++a) {
        if (place[static_cast<std::size_t>(crs.cols[a])] < 0) {
          place[static_cast<std::size_t>(crs.cols[a])] = 0;
          columns.push_back(crs.cols[a]);
        }
        w.col(crs.cols[a]) += crs.values[a] * own;
      }
    }
    v.diagonal().array() += 1e-12;
    const MatrixXd touched = w(Eigen::all, columns);
    const MatrixXd taken = touched.transpose() * v.inverse() * touched;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (std::size_t r = 0; r < columns.size(); ++r) {
        information(columns[r], columns[c]) -=
            taken(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
      }
      place[static_cast<std::size_t>(columns[c])] = -1;
    }
  }
  for (int k = kLensSize; k < cameras; ++k) {  // what was held has none
    if (information(k, k) <= 0.0) information(k, k) = 1e18;
  }
  const Eigen::LDLT<MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const LensMatrix covariance =
      factor.solve(MatrixXd::Identity(cameras, kLensSize)).topRows<kLensSize>();
  if (!covariance.allFinite() || (covariance.diagonal().array() <= 0.0).any()) return std::nullopt;
  return covariance;
}

/// Distances from the first keyframe keep their sum.
void KeepScale(const LensBundle& before, LensBundle& after) {
  const Vector3d from = before.world_from_camera.front().translation;
  const Vector3d centre = after.world_from_camera.front().translation;
  double was = 0.0, is = 0.0;
  for (std::size_t k = 1; k < before.world_from_camera.size(); ++k) {
    was += (before.world_from_camera[k].translation - from).norm();
    is += (after.world_from_camera[k].translation - centre).norm();
  }
  if (!(was > 0.0 && is > 0.0)) return;
  const double scale = was / is;
  for (Rigid3& pose : after.world_from_camera) {
    pose.translation = centre + scale * (pose.translation - centre);
  }
  for (LensBundle::Point& point : after.points) point.inverse_range /= scale;
}

bool Invertible(const CameraIntrinsics& lens) {
  const CameraModel camera(lens);
  const double right = lens.width - 1, low = lens.height - 1;
  for (const Vector2d& pixel :
       {Vector2d(0, 0), Vector2d(right, 0), Vector2d(0, low), Vector2d(right, low)}) {
    if (!camera.Unproject(pixel)) return false;
  }
  return true;
}

std::optional<LensBundleSolution> AdjustOnce(const LensBundle& problem,
                                             const CameraIntrinsics& like,
                                             const std::atomic<bool>& stop) {
  Adjustment adjustment(problem);
  LensBundleSolution solution;
  solution.rms_px_before = adjustment.Rms_px();
  if (!adjustment.Solve(stop)) return std::nullopt;
  solution.rms_px_after = adjustment.Rms_px();
  solution.observations = adjustment.observations();
  const auto covariance = adjustment.Covariance();
  if (!covariance || stop) return std::nullopt;
  solution.covariance = *covariance;
  solution.problem = adjustment.Estimates();
  if (!Invertible(LensOf(solution.problem.lens, like))) return std::nullopt;
  if (problem.known.empty()) KeepScale(problem, solution.problem);
  return solution;
}

}  // namespace

CameraIntrinsics LensOf(const LensVector& lens, const CameraIntrinsics& like) {
  CameraIntrinsics camera = like;
  camera.model = LensModel::kBrownConrady;
  camera.fx = camera.fy = std::exp(lens[0]);
  camera.cx = lens[1];
  camera.cy = lens[2];
  camera.distortion = {lens[3], lens[4], lens[5], lens[6], lens[7]};
  return camera;
}

LensVector LensVectorOf(const CameraIntrinsics& camera) {
  LensVector lens;
  lens << std::log(0.5 * (camera.fx + camera.fy)), camera.cx, camera.cy, 0.0, 0.0, 0.0, 0.0, 0.0;
  if (camera.model == LensModel::kBrownConrady) {
    for (int k = 0; k < 5; ++k) lens[3 + k] = camera.distortion[static_cast<std::size_t>(k)];
  }
  return lens;
}

std::optional<LensBundleSolution> AdjustLens(LensBundle problem, const CameraIntrinsics& like,
                                             const std::atomic<bool>& stop) {
  if (std::ssize(problem.world_from_camera) < kFewestKeyframes ||
      std::ssize(problem.sightings) + std::ssize(problem.known) < kFewestSightings) {
    return std::nullopt;
  }
  auto solution = AdjustOnce(problem, like, stop);
  if (solution || stop) return solution;
  // Too little to tell higher terms by: they bend the corners, where nothing was seen, back.
  constexpr double kHeld = 1e-6;
  for (const int k : {5, 6, 7}) {
    problem.lens[k] = problem.prior[k] = 0.0;
    problem.prior_covariance.row(k).setZero();
    problem.prior_covariance.col(k).setZero();
    problem.prior_covariance(k, k) = kHeld * kHeld;
  }
  return AdjustOnce(problem, like, stop);
}

}  // namespace saccade
