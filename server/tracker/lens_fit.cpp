#include "server/tracker/lens_fit.hpp"

#include <algorithm>
#include <cmath>

#include "server/filter/point_model.hpp"

namespace saccade {
namespace {

constexpr int kFewestViews = 3;    // of a point: two say nothing about a lens
constexpr int kFewestPoints = 15;  // in all
constexpr int kIterations = 6;     // without the stretch, and with it
constexpr double kHuber_px = 1.5;
constexpr double kDamping = 1e-6;  // of the diagonal: scale is free, and must not run away
constexpr double kLeastNoise_px = 0.2;

struct PointSight {
  int view = 0;
  Eigen::Vector2d pixel;
};
struct Point {
  Eigen::Vector3d in_world;
  std::vector<PointSight> sights;
};

/// The first view stays; unknown: six of each other one, then the stretch, if it is sought.
class Adjustment {
 public:
  Adjustment(const CameraModel& camera, std::vector<LensView> views, std::vector<Point> points)
      : camera_(camera), views_(std::move(views)), points_(std::move(points)) {
    const CameraIntrinsics& lens = camera.intrinsics();
    centre_ = {lens.cx, lens.cy};
    half_diagonal_px_ = 0.5 * std::hypot(lens.width, lens.height);
  }

  /// One step. False if it cannot be taken.
  bool Improve(bool with_stretch) {
    const int cameras = 6 * (static_cast<int>(views_.size()) - 1);
    const int unknown = cameras + (with_stretch ? 2 : 0);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknown, unknown);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(unknown);
    std::vector<Eigen::MatrixXd> back;  // by point: step = own - back * step of the others
    std::vector<Eigen::Vector3d> own;
    for (const Point& point : points_) {
      Eigen::Matrix3d v = Eigen::Matrix3d::Zero();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      Eigen::MatrixXd w = Eigen::MatrixXd::Zero(unknown, 3);
      for (const PointSight& sight : point.sights) {
        const auto line = Linearise(point, sight);
        if (!line) continue;
        const Eigen::Matrix<double, 2, 3> to_point = -line->d_camera.leftCols<3>();
        v += line->weight * to_point.transpose() * to_point;
        b += line->weight * to_point.transpose() * line->residual;
        const auto add = [&](int at, const auto& jacobian) {
          const int n = static_cast<int>(jacobian.cols());
          normal.block(at, at, n, n) += line->weight * jacobian.transpose() * jacobian;
          pull.segment(at, n) += line->weight * jacobian.transpose() * line->residual;
          w.middleRows(at, n) += line->weight * jacobian.transpose() * to_point;
        };
        const int at = 6 * (sight.view - 1);
        if (sight.view > 0) add(at, line->d_camera);
        if (!with_stretch) continue;
        add(cameras, line->d_stretch);
        if (sight.view == 0) continue;
        const Eigen::Matrix<double, 6, 2> cross =
            line->weight * line->d_camera.transpose() * line->d_stretch;
        normal.block<6, 2>(at, cameras) += cross;
        normal.block<2, 6>(cameras, at) += cross.transpose();
      }
      v.diagonal() *= 1.0 + kDamping;
      v.diagonal().array() += 1e-9;
      const Eigen::Matrix3d inverse = v.inverse();
      const Eigen::MatrixXd gain = w * inverse;
      normal.noalias() -= gain * w.transpose();
      pull.noalias() -= gain * b;
      back.push_back(gain.transpose());
      own.emplace_back(inverse * b);
    }
    normal.diagonal() *= 1.0 + kDamping;
    normal.diagonal().array() += 1e-9;
    const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::VectorXd step = factor.solve(pull);
    if (!step.allFinite()) return false;
    for (std::size_t k = 1; k < views_.size(); ++k) {
      Rigid3& pose = views_[k].world_from_camera;
      pose.translation += step.segment<3>(6 * (static_cast<int>(k) - 1));
      pose.rotation =
          (pose.rotation * ExpQuaternion(step.segment<3>(6 * (static_cast<int>(k) - 1) + 3)))
              .normalized();
    }
    for (std::size_t k = 0; k < points_.size(); ++k) {
      points_[k].in_world += own[k] - back[k] * step;
    }
    if (!with_stretch) return true;
    stretch_ += step.tail<2>();
    covariance_ =
        factor.solve(Eigen::MatrixXd::Identity(unknown, unknown)).bottomRightCorner<2, 2>();
    return stretch_.norm() < 1.0;
  }

  /// Of the residuals, Huber's weights counted in.
  double Rms_px(int* observations) const {
    double sum = 0.0, weights = 0.0;
    for (const Point& point : points_) {
      for (const PointSight& sight : point.sights) {
        const auto line = Linearise(point, sight);
        if (!line) continue;
        sum += line->weight * line->residual.squaredNorm();
        weights += 2.0 * line->weight;
        if (observations != nullptr) ++*observations;
      }
    }
    return weights > 0.0 ? std::sqrt(sum / weights) : 0.0;
  }

  const Eigen::Vector2d& stretch() const { return stretch_; }
  const Eigen::Matrix2d& covariance() const { return covariance_; }

 private:
  struct Line {
    Eigen::Vector2d residual;
    Eigen::Matrix<double, 2, 6> d_camera;
    Eigen::Matrix2d d_stretch;
    double weight = 1.0;
  };

  std::optional<Line> Linearise(const Point& point, const PointSight& sight) const {
    const auto at = PredictFixed(camera_, views_[sight.view].world_from_camera, point.in_world);
    if (!at) return std::nullopt;
    const Eigen::Vector2d from_centre = at->pixel - centre_;
    const double scale = 1.0 / (half_diagonal_px_ * half_diagonal_px_);
    const double rho2 = from_centre.squaredNorm() * scale;
    const double factor = 1.0 + stretch_[0] + stretch_[1] * rho2;
    Line line;
    line.residual = sight.pixel - centre_ - factor * from_centre;
    const Eigen::Matrix2d bend = factor * Eigen::Matrix2d::Identity() +
                                 2.0 * stretch_[1] * scale * from_centre * from_centre.transpose();
    line.d_camera = bend * at->d_camera;
    line.d_stretch << from_centre, from_centre * rho2;
    const double length = line.residual.norm();
    line.weight = length <= kHuber_px ? 1.0 : kHuber_px / length;
    return line;
  }

  const CameraModel& camera_;
  std::vector<LensView> views_;
  std::vector<Point> points_;
  Eigen::Vector2d centre_;
  double half_diagonal_px_ = 1.0;
  Eigen::Vector2d stretch_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Identity();
};

std::vector<Point> PointsOf(const std::vector<LensView>& views,
                            const std::map<FeatureId, Eigen::Vector3d>& points_in_world) {
  std::map<FeatureId, Point> by_id;
  for (std::size_t view = 0; view < views.size(); ++view) {
    for (const LensView::Seen& seen : views[view].seen) {
      const auto at = points_in_world.find(seen.id);
      if (at == points_in_world.end()) continue;
      Point& point = by_id[seen.id];
      point.in_world = at->second;
      point.sights.push_back({static_cast<int>(view), seen.pixel});
    }
  }
  std::vector<Point> points;
  for (auto& [id, point] : by_id) {
    if (std::ssize(point.sights) >= kFewestViews) points.push_back(std::move(point));
  }
  return points;
}

}  // namespace

double LensFit::SigmaAt(double rho) const {
  const Eigen::Vector2d by(1.0, rho * rho);
  return std::sqrt(std::max(0.0, by.dot(covariance * by)));
}

std::optional<LensFit> FitLens(const CameraModel& camera, std::vector<LensView> views,
                               const std::map<FeatureId, Eigen::Vector3d>& points_in_world) {
  std::vector<Point> points = PointsOf(views, points_in_world);
  if (std::ssize(points) < kFewestPoints) return std::nullopt;
  Adjustment adjustment(camera, std::move(views), std::move(points));
  LensFit fit;
  for (int i = 0; i < kIterations; ++i) {
    if (!adjustment.Improve(/*with_stretch=*/false)) return std::nullopt;
  }
  fit.rms_px = adjustment.Rms_px(nullptr);
  for (int i = 0; i < kIterations; ++i) {
    if (!adjustment.Improve(/*with_stretch=*/true)) return std::nullopt;
  }
  fit.best_rms_px = adjustment.Rms_px(&fit.observations);
  if (!(fit.best_rms_px <= fit.rms_px)) return std::nullopt;  // has run away
  fit.stretch = adjustment.stretch();
  const double noise_px = std::max(kLeastNoise_px, fit.best_rms_px);
  fit.covariance = noise_px * noise_px * adjustment.covariance();
  return fit;
}

}  // namespace saccade
