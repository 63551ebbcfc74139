#include "server/tracker/marker_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "server/filter/motion_model.hpp"
#include "server/filter/point_model.hpp"

namespace saccade {
namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

constexpr int kRounds = 25;
constexpr double kSameAngle_rad = 0.09;
constexpr double kFar_sigmas = 6.0;  // residuals beyond count linearly

struct Guess {
  Rigid3 world_from_marker;
  double log_metre = 0.0;
};

struct Cost {
  double robust = 0.0, squares = 0.0;  // squares [px^2]
  Matrix7d information = Matrix7d::Zero();
  Vector7d pulled = Vector7d::Zero();
  bool valid = true;
};

Cost Linearise(const CameraModel& camera, std::span<const MarkerView> views, double side_m,
               const Guess& guess, double sigma_px) {
  Cost cost;
  const double metre = std::exp(guess.log_metre);
  const Eigen::Matrix3d turn = guess.world_from_marker.RotationMatrix();
  for (const MarkerView& view : views) {
    const auto corners = SquareCorners(view.sighting.family, metre * side_m);
    for (int k = 0; k < 4; ++k) {
      const auto at =
          PredictFixed(camera, view.world_from_camera, guess.world_from_marker * corners[k]);
      if (!at) {
        cost.valid = false;
        return cost;
      }
      const Eigen::Matrix<double, 2, 3> d_point = -at->d_camera.leftCols<3>();
      Eigen::Matrix<double, 2, 7> h;
      h << d_point, -d_point * turn * Skew(corners[k]), d_point * (turn * corners[k]);
      const Eigen::Vector2d off = view.sighting.corners[k] - at->pixel;
      const double sigmas = off.norm() / sigma_px;
      const double weight = sigmas > kFar_sigmas ? kFar_sigmas / sigmas : 1.0;
      cost.robust +=
          sigmas > kFar_sigmas ? kFar_sigmas * (2.0 * sigmas - kFar_sigmas) : sigmas * sigmas;
      cost.squares += off.squaredNorm();
      cost.information += weight / (sigma_px * sigma_px) * h.transpose() * h;
      cost.pulled += weight / (sigma_px * sigma_px) * h.transpose() * off;
    }
  }
  return cost;
}

struct Solved {
  Guess guess;
  Cost cost;
};

std::optional<Solved> Solve(const CameraModel& camera, std::span<const MarkerView> views,
                            double side_m, Guess guess, const MarkerFitOptions& options) {
  Cost cost = Linearise(camera, views, side_m, guess, options.sigma_px);
  if (!cost.valid) return std::nullopt;
  const int size = options.metric ? 6 : 7;
  double damping = 1e-4;
  for (int round = 0; round < kRounds; ++round) {
    Matrix7d damped = cost.information;
    damped.diagonal() *= 1.0 + damping;
    Vector7d step = Vector7d::Zero();
    step.head(size) = damped.topLeftCorner(size, size).ldlt().solve(cost.pulled.head(size));
    if (!step.allFinite() || std::abs(step[6]) > 2.0) return std::nullopt;
    // The scale is about the marker's own middle, and a pose's step is in world.
    const Guess next{PlusPose(guess.world_from_marker, step.head<6>()), guess.log_metre + step[6]};
    const Cost after = Linearise(camera, views, side_m, next, options.sigma_px);
    if (after.valid && after.robust < cost.robust) {
      const bool settled = cost.robust - after.robust < 1e-6 * (1.0 + cost.robust);
      guess = next;
      cost = after;
      damping = std::max(1e-9, 0.2 * damping);
      if (settled) break;
    } else {
      damping *= 10.0;
      if (damping > 1e8) break;
    }
  }
  return Solved{guess, cost};
}

/// Where the rays to the square's middle come closest to each other.
std::optional<Eigen::Vector3d> MeetingPoint(const CameraModel& camera,
                                            std::span<const MarkerView> views) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const MarkerView& view : views) {
    const auto ray = camera.Unproject(Middle(view.sighting));
    if (!ray) continue;
    const Eigen::Vector3d direction = view.world_from_camera.rotation * *ray;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    a += across;
    b += across * view.world_from_camera.translation;
  }
  const Eigen::LDLT<Eigen::Matrix3d> factor(a);
  if (factor.info() != Eigen::Success || factor.vectorD().minCoeff() < 1e-9) return std::nullopt;
  const Eigen::Vector3d point = factor.solve(b);
  if (!point.allFinite()) return std::nullopt;
  return point;
}

}  // namespace

std::optional<MarkerFit> FitMarker(const CameraModel& camera, std::span<const MarkerView> views,
                                   double side_m, const MarkerFitOptions& options) {
  if (static_cast<int>(views.size()) < options.fewest_views) return std::nullopt;
  double metre = 1.0;
  const auto middle = options.metric ? std::nullopt : MeetingPoint(camera, views);
  if (!options.metric && !middle) return std::nullopt;
  // Hypotheses: both poses of the first, the middle and the last view.
  std::vector<Solved> solved;
  for (const std::size_t k : {std::size_t{0}, views.size() / 2, views.size() - 1}) {
    const MarkerView& view = views[k];
    const auto single = PoseOfSquare(camera, view.sighting, side_m);
    if (!single) continue;
    for (const Rigid3& square_from_camera : {single->square_from_camera, single->other}) {
      Rigid3 camera_from_square = square_from_camera.Inverse();
      if (middle) {
        const double range = (*middle - view.world_from_camera.translation).norm();
        metre = range / camera_from_square.translation.norm();
        if (!(metre > 1e-4 && metre < 1e4)) continue;
      }
      camera_from_square.translation *= metre;
      const Guess guess{view.world_from_camera * camera_from_square, std::log(metre)};
      if (auto one = Solve(camera, views, side_m, guess, options)) solved.push_back(*one);
    }
  }
  if (solved.empty()) return std::nullopt;
  const auto best =
      std::ranges::min_element(solved, {}, [](const Solved& each) { return each.cost.robust; });
  const double count = 4.0 * static_cast<double>(views.size());
  const double rms = std::sqrt(best->cost.squares / count);
  if (rms > options.most_rms_px) return std::nullopt;
  const double scale = std::max(1.0, rms * rms / (options.sigma_px * options.sigma_px));
  for (const Solved& other : solved) {
    const bool same = RotationAngle(other.guess.world_from_marker, best->guess.world_from_marker) <
                      kSameAngle_rad;
    if (!same && other.cost.robust - best->cost.robust < options.least_evidence * scale) {
      return std::nullopt;
    }
  }
  const int size = options.metric ? 6 : 7;
  const Eigen::LDLT<Eigen::MatrixXd> factor(best->cost.information.topLeftCorner(size, size));
  const Eigen::MatrixXd covariance = scale * factor.solve(Eigen::MatrixXd::Identity(size, size));
  if (!covariance.allFinite()) return std::nullopt;
  MarkerFit fit;
  fit.world_from_marker = best->guess.world_from_marker;
  fit.metre = std::exp(best->guess.log_metre);
  fit.rms_px = rms;
  fit.covariance = covariance.topLeftCorner<6, 6>();
  if (!options.metric) fit.log_metre_sigma = std::sqrt(std::max(0.0, covariance(6, 6)));
  return fit;
}

}  // namespace saccade
