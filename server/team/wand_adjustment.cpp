#include "server/team/wand_adjustment.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kDof = 4.0;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Normal equations with the bodies' blocks apart.
struct System {
  explicit System(int cameras, std::size_t instants)
      : camera(Eigen::MatrixXd::Zero(6 * cameras, 6 * cameras)),
        right(Eigen::VectorXd::Zero(6 * cameras)),
        wand(instants, Matrix6d::Zero()),
        wand_right(instants, Vector6d::Zero()),
        between(instants) {}

  Eigen::MatrixXd camera;
  Eigen::VectorXd right;
  std::vector<Matrix6d> wand;
  std::vector<Vector6d> wand_right;
  std::vector<std::map<int, Matrix6d>> between;  // by the camera's slot
  double cost = 0.0, sum_px2 = 0.0;
  std::size_t points = 0;
};

class Problem {
 public:
  Problem(const std::vector<CameraModel>& lenses, const std::vector<WandView>& views, int fixed,
          double sigma_px, const WandPoses& poses)
      : lenses_(lenses), sigma_px_(sigma_px), slots_(lenses.size(), -1) {
    for (const WandView& view : views) {
      const auto c = static_cast<std::size_t>(view.camera);
      if (!poses.world_from_camera[c] ||
          !poses.world_from_wand[static_cast<std::size_t>(view.instant)]) {
        continue;
      }
      if (fixed != kAllCameras && view.camera != fixed && slots_[c] < 0) slots_[c] = cameras_++;
      views_.push_back(&view);
    }
  }

  bool empty() const { return views_.empty(); }
  const std::vector<int>& slots() const { return slots_; }

  /// Nothing where a point is behind its camera.
  std::optional<System> Build(const WandPoses& poses) const {
    System system(cameras_, poses.world_from_wand.size());
    for (const WandView* view : views_) {
      if (!Add(*view, poses, system)) return std::nullopt;
    }
    return system;
  }

  /// Moves what is placed by the solution of the damped system; nothing if it is singular.
  std::optional<WandPoses> Step(const System& system, double damping,
                                const WandPoses& poses) const {
    Eigen::MatrixXd reduced = system.camera;
    reduced.diagonal() *= 1.0 + damping;
    Eigen::VectorXd right = system.right;
    std::vector<Eigen::LDLT<Matrix6d>> factors(system.wand.size());
    for (std::size_t k = 0; k < system.wand.size(); ++k) {
      if (!Seen(system, k)) continue;
      Matrix6d damped = system.wand[k];
      damped.diagonal() *= 1.0 + damping;
      factors[k].compute(damped);
      Reduce(system, k, factors[k], reduced, &right);
    }
    Eigen::VectorXd by(right.size());
    if (right.size() > 0) by = reduced.ldlt().solve(right);
    if (!by.allFinite()) return std::nullopt;
    WandPoses moved = poses;
    for (std::size_t c = 0; c < slots_.size(); ++c) {
      if (slots_[c] >= 0) Move(by.segment<6>(6 * slots_[c]), *moved.world_from_camera[c]);
    }
    for (std::size_t k = 0; k < system.wand.size(); ++k) {
      if (!Seen(system, k)) continue;
      Vector6d rest = system.wand_right[k];
      for (const auto& [slot, block] : system.between[k]) {
        rest -= block.transpose() * by.segment<6>(6 * slot);
      }
      const Vector6d step = factors[k].solve(rest);
      if (!step.allFinite()) return std::nullopt;
      Move(step, *moved.world_from_wand[k]);
    }
    return moved;
  }

  Eigen::MatrixXd CameraCovariance(const System& system) const {
    Eigen::MatrixXd reduced = system.camera;
    for (std::size_t k = 0; k < system.wand.size(); ++k) {
      if (!Seen(system, k)) continue;
      Reduce(system, k, Eigen::LDLT<Matrix6d>(system.wand[k]), reduced, nullptr);
    }
    return reduced.ldlt().solve(Eigen::MatrixXd::Identity(reduced.rows(), reduced.cols()));
  }

 private:
  static bool Seen(const System& system, std::size_t k) { return system.wand[k](0, 0) > 0.0; }

  static void Move(const Vector6d& by, Rigid3& pose) {
    pose.translation += by.head<3>();
    pose.rotation = (pose.rotation * ExpQuaternion(by.tail<3>())).normalized();
  }

  static void Reduce(const System& system, std::size_t k, const Eigen::LDLT<Matrix6d>& factor,
                     Eigen::MatrixXd& reduced, Eigen::VectorXd* right) {
    for (const auto& [a, block] : system.between[k]) {
      const Matrix6d gain = factor.solve(block.transpose()).transpose();
      if (right != nullptr) right->segment<6>(6 * a) -= gain * system.wand_right[k];
      for (const auto& [b, other] : system.between[k]) {
        reduced.block<6, 6>(6 * a, 6 * b) -= gain * other.transpose();
      }
    }
  }

  bool Add(const WandView& view, const WandPoses& poses, System& system) const {
    const auto c = static_cast<std::size_t>(view.camera),
               k = static_cast<std::size_t>(view.instant);
    const Rigid3 &camera = *poses.world_from_camera[c], &wand = *poses.world_from_wand[k];
    const Eigen::Matrix3d to_camera = camera.RotationMatrix().transpose();
    const Eigen::Matrix3d turned = to_camera * wand.RotationMatrix();
    const int slot = slots_[c];
    for (std::size_t p = 0; p < view.points.size(); ++p) {
      const Eigen::Vector3d in_camera = to_camera * (wand * view.points[p] - camera.translation);
      Eigen::Matrix<double, 2, 3> d_pixel;
      const auto pixel = lenses_[c].Project(in_camera, &d_pixel);
      if (!pixel) return false;
      const Eigen::Vector2d r = (view.pixels[p] - *pixel) / sigma_px_;
      Eigen::Matrix<double, 2, 6> by_wand, by_camera;
      by_wand << d_pixel * to_camera, -d_pixel * turned * Skew(view.points[p]);
      by_camera << -d_pixel * to_camera, d_pixel * Skew(in_camera);
      by_wand /= sigma_px_;
      by_camera /= sigma_px_;
      const double weight = (kDof + 2.0) / (kDof + r.squaredNorm());
      system.cost += (kDof + 2.0) * std::log1p(r.squaredNorm() / kDof);
      system.sum_px2 += weight * r.squaredNorm() * sigma_px_ * sigma_px_;
      ++system.points;
      system.wand[k] += weight * by_wand.transpose() * by_wand;
      system.wand_right[k] += weight * by_wand.transpose() * r;
      if (slot < 0) continue;
      system.camera.block<6, 6>(6 * slot, 6 * slot) += weight * by_camera.transpose() * by_camera;
      system.right.segment<6>(6 * slot) += weight * by_camera.transpose() * r;
      const auto [at, fresh] = system.between[k].try_emplace(slot, Matrix6d::Zero());
      at->second += weight * by_camera.transpose() * by_wand;
    }
    return true;
  }

  const std::vector<CameraModel>& lenses_;
  double sigma_px_;
  std::vector<int> slots_;  // of each camera among the unknowns; -1: fixed or not placed
  int cameras_ = 0;
  std::vector<const WandView*> views_;
};

}  // namespace

std::optional<WandFit> AdjustWand(const std::vector<CameraModel>& lenses,
                                  const std::vector<WandView>& views, int fixed, double sigma_px,
                                  int iterations, WandPoses& poses) {
  const Problem problem(lenses, views, fixed, sigma_px, poses);
  if (problem.empty()) return std::nullopt;
  WandPoses best = poses;
  std::optional<System> system = problem.Build(best);
  if (!system) return std::nullopt;
  double damping = 1e-4;
  for (int k = 0; k < iterations; ++k) {
    const std::optional<WandPoses> moved = problem.Step(*system, damping, best);
    std::optional<System> there;
    if (moved) there = problem.Build(*moved);
    if (there && there->cost <= system->cost) {
      const double gained = system->cost - there->cost;
      best = *moved;
      system = std::move(there);
      damping = std::max(damping * 0.1, 1e-9);
      if (gained < 1e-7 * (1.0 + system->cost)) break;
    } else if ((damping *= 10.0) > 1e8) {
      break;
    }
  }
  poses = best;
  WandFit fit;
  fit.points = system->points;
  fit.rms_px = std::sqrt(system->sum_px2 / static_cast<double>(system->points));
  if (fixed == kAllCameras) return fit;
  const Eigen::MatrixXd covariance = problem.CameraCovariance(*system);
  for (std::size_t c = 0; c < problem.slots().size(); ++c) {
    const int slot = problem.slots()[c];
    if (slot < 0) continue;
    fit.camera_covariance[static_cast<int>(c)] = covariance.block<6, 6>(6 * slot, 6 * slot);
  }
  return fit;
}

std::optional<double> ViewError(const CameraModel& lens, const WandView& view,
                                const Rigid3& camera_from_wand) {
  double sum = 0.0;
  for (std::size_t p = 0; p < view.points.size(); ++p) {
    const auto pixel = lens.Project(camera_from_wand * view.points[p]);
    if (!pixel) return std::nullopt;
    sum += (*pixel - view.pixels[p]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(view.points.size()));
}

}  // namespace saccade
