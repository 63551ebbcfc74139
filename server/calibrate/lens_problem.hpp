#pragma once

#include <Eigen/Dense>
#include <opencv2/core.hpp>
#include <stop_token>
#include <utility>
#include <vector>

#include "server/calibrate/board.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// rotation (axis times angle) and translation of camera_from_board.
using BoardPose = Eigen::Matrix<double, 6, 1>;

/// What is fitted: a model, and of Brown and Conrady's whether with k3, which Kalibr has not.
struct LensChoice {
  LensModel model = LensModel::kBrownConrady;  // or kKannalaBrandt
  bool k3 = true;

  LensChoice(LensModel of, bool with_k3 = true)
      : model(of), k3(with_k3) {}  // NOLINT: a model is one
};

/// Least squares over one lens and the board's pose in each view: the lens parameters are [fx fy cx
/// cy coefficients], poses are eliminated view by view.
class LensProblem {
 public:
  explicit LensProblem(LensChoice choice, std::stop_token stop = {})
      : fisheye_(choice.model == LensModel::kKannalaBrandt),
        parameters_(fisheye_ || !choice.k3 ? 8 : 9),
        stop_(std::move(stop)) {}

  int parameters() const { return parameters_; }
  /// Pose by perspective-n-point with this lens; false where that has no answer.
  bool StartPose(const Eigen::VectorXd& lens, const BoardView& view, BoardPose& pose) const;
  /// Corners predicted minus those seen, interleaved x y; the Jacobians if asked for.
  Eigen::VectorXd Residuals(const Eigen::VectorXd& lens, const BoardPose& pose,
                            const BoardView& view, Eigen::MatrixXd* by_lens,
                            Eigen::MatrixXd* by_pose) const;

  struct State {
    Eigen::VectorXd lens;
    std::vector<BoardPose> poses;
    double cost = 0;  // Huber's, over all views
  };
  /// Levenberg-Marquardt over the lens parameters that `free` names (by index; none: poses alone)
  /// and all poses.
  void Minimise(const std::vector<const BoardView*>& views, const std::vector<bool>& free,
                double huber_px, int iterations, State& state) const;
  /// Covariance of the lens at the minimum: per entry of the diagonal the larger of that of
  /// independent corners and that of independent views.
  Eigen::MatrixXd Covariance(const std::vector<const BoardView*>& views, double huber_px,
                             const State& state) const;

 private:
  struct Normal;  // one view's share of the normal equations
  Normal Accumulate(const Eigen::VectorXd& lens, const BoardPose& pose, const BoardView& view,
                    const std::vector<bool>& free, double huber_px) const;
  /// One damped step from `state`.
  State Stepped(const State& state, const std::vector<Normal>& normals,
                const std::vector<bool>& free, double damping) const;
  double Cost(const std::vector<const BoardView*>& views, double huber_px,
              const State& state) const;

  bool fisheye_;
  int parameters_;
  std::stop_token stop_;  // Minimise() ends early
};

}  // namespace saccade
