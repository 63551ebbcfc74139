#include "server/map/bundle_adjustment.hpp"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>

#include "server/map/bundle_costs.hpp"

namespace saccade {
namespace {

constexpr double kBehind = 1e-3;     // cosine below which a ray is not seen
constexpr double kLossSigmas = 1.0;  // matches' sigmas are set with a margin

/// Tangent coordinates of `direction` (any length) around a measured ray, in sigmas.
struct RayError {
  RayError(const Eigen::Vector3d& measured, double sigma_rad)
      : ray(measured), weighted_basis(TangentBasis(measured) / sigma_rad) {}

  template <typename T>
  bool operator()(const Vec3<T>& direction, T* residual) const {
    const T along = direction.dot(ray.cast<T>());
    if (along < T(kBehind) * direction.norm()) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> error(residual);
    error = weighted_basis.cast<T>().transpose() * direction / along;
    return true;
  }

  Eigen::Vector3d ray;
  Eigen::Matrix<double, 3, 2> weighted_basis;
};

struct SightingCost {
  RayError error;
  BearingOf bearing;

  template <typename T>
  bool operator()(const T* camera, const T* anchor, const T* point, T* residual) const {
    return error(DirectionIn(camera, anchor, point, bearing), residual);
  }
};

struct BirthCost {
  RayError error;
  BearingOf bearing;
  double prior_inverse_range, prior_sigma;

  template <typename T>
  bool operator()(const T* point, T* residual) const {
    residual[2] = (point[2] - T(prior_inverse_range)) / T(prior_sigma);
    return error(bearing(point), residual);
  }
};

struct KnownCost {
  RayError error;
  Eigen::Vector3d point;

  template <typename T>
  bool operator()(const T* camera, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> turn(camera);
    const Eigen::Map<const Vec3<T>> at(camera + 4);
    return error(Vec3<T>(turn.conjugate() * (point.cast<T>() - at)), residual);
  }
};

/// The problem as Ceres sees it; blocks keep their addresses.
class Adjustment {
 public:
  explicit Adjustment(BundleProblem& bundle) : bundle_(bundle) {
    for (const BundleKeyframe& keyframe : bundle.keyframes) {
      poses_.push_back(Pack(keyframe.world_from_camera));
    }
    for (const BundlePoint& point : bundle.points) {
      points_.push_back({0.0, 0.0, point.inverse_range});
      bearings_.push_back({point.bearing, TangentBasis(point.bearing)});
    }
    AddResiduals();
    Constrain();
  }

  bool Solve(const std::atomic<bool>& stop) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (PointBlock& point : points_) AddTo(*options.linear_solver_ordering, point.data(), 0);
    for (PoseBlock& pose : poses_) AddTo(*options.linear_solver_ordering, pose.data(), 1);
    options.max_num_iterations = bundle_.iterations;
    options.function_tolerance = 1e-3;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    Stopper stopper(stop);
    options.callbacks.push_back(&stopper);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable() && summary.final_cost <= summary.initial_cost && !stop;
  }

  void Read() const {
    const double scale = held_ ? ScaleChange() : 1.0;
    const Eigen::Vector3d centre = bundle_.keyframes.front().world_from_camera.translation;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (bundle_.keyframes[k].fixed) continue;
      Rigid3& pose = bundle_.keyframes[k].world_from_camera;
      pose = Unpack(poses_[k]);
      pose.translation = centre + scale * (pose.translation - centre);
    }
    for (std::size_t k = 0; k < points_.size(); ++k) {
      bundle_.points[k].bearing = bearings_[k](points_[k].data());
      bundle_.points[k].inverse_range = points_[k][2] / scale;
    }
  }

 private:
  void AddTo(ceres::ParameterBlockOrdering& ordering, double* block, int group) const {
    if (problem_.HasParameterBlock(block)) ordering.AddElementToGroup(block, group);
  }

  void AddResiduals() {
    const auto loss = [] { return new ceres::CauchyLoss(kLossSigmas); };
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const BundlePoint& point = bundle_.points[k];
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<BirthCost, 3, 3>(new BirthCost{
                                    RayError(point.seen, point.seen_sigma_rad), bearings_[k],
                                    point.prior_inverse_range, point.prior_sigma}),
                                nullptr, points_[k].data());
    }
    // What is behind a camera to begin with would end the whole adjustment.
    for (const BundleSighting& sighting : bundle_.sightings) {
      const int anchor = bundle_.points[sighting.point].anchor;
      double *camera = poses_[sighting.keyframe].data(), *first = poses_[anchor].data(),
             *point = points_[sighting.point].data();
      const SightingCost cost{RayError(sighting.ray, sighting.sigma_rad),
                              bearings_[sighting.point]};
      double residual[2];
      if (!cost(camera, first, point, residual)) continue;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<SightingCost, 2, 7, 7, 3>(new SightingCost(cost)), loss(),
          camera, first, point);
    }
    for (const BundleKnownSighting& sighting : bundle_.known) {
      double* camera = poses_[sighting.keyframe].data();
      const KnownCost cost{RayError(sighting.ray, sighting.sigma_rad), sighting.point_in_world};
      double residual[2];
      if (!cost(camera, residual)) continue;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<KnownCost, 2, 7>(new KnownCost(cost)), loss(), camera);
    }
  }

  void Constrain() {
    int fixed = 0;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      double* block = poses_[k].data();
      if (!problem_.HasParameterBlock(block)) continue;
      problem_.SetManifold(block, new PoseManifold);
      if (!bundle_.keyframes[k].fixed) continue;
      problem_.SetParameterBlockConstant(block);
      ++fixed;
    }
    held_ = fixed < 2 && bundle_.known.empty();
    if (held_ && fixed == 0 && problem_.HasParameterBlock(poses_.front().data())) {
      problem_.SetParameterBlockConstant(poses_.front().data());
    }
  }

  /// By how much lengths must be multiplied to keep the scale of the inverse ranges.
  double ScaleChange() const {
    double sum = 0.0, weight = 0.0;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const double before = bundle_.points[k].inverse_range, after = points_[k][2];
      if (before <= 0.0 || after <= 0.0) continue;
      const double parallax = bundle_.points[k].parallax_sigmas;
      const double worth = parallax * parallax;
      sum += worth * std::clamp(std::log(after / before), -1.0, 1.0);
      weight += worth;
    }
    return weight > 0.0 ? std::exp(sum / weight) : 1.0;
  }

  BundleProblem& bundle_;
  std::vector<PoseBlock> poses_;
  std::vector<PointBlock> points_;
  std::vector<BearingOf> bearings_;
  ceres::Problem problem_;
  bool held_ = false;  // place and scale by convention
};

}  // namespace

bool AdjustBundle(BundleProblem& problem, const std::atomic<bool>& stop) {
  if (problem.keyframes.size() < 3 || problem.points.empty()) return false;
  // A step that fails is told by the answer; nobody reads Ceres' warnings on stderr.
  static const int kLevel = FLAGS_minloglevel = google::GLOG_FATAL;
  static_cast<void>(kLevel);
  Adjustment adjustment(problem);
  if (!adjustment.Solve(stop)) return false;
  adjustment.Read();
  return true;
}

}  // namespace saccade
