#include "server/team/merge/map_fit.hpp"

#include <cmath>

namespace saccade {
namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;

constexpr int kIterations = 12, kFewest = 24;
constexpr double kHuber_px = 4.0, kAgrees_px = 12.0;  // at 640 pixels
constexpr double kSigma_px = 1.5;

/// A point of one map and the pixel that shows it in a picture of the other.
struct Sighting {
  bool own_point = false;  // seen in a picture of the other map
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  const PlaceView* seen_by = nullptr;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  int cluster = 0;
};

std::vector<Sighting> Collect(std::span<const JoinedPlace* const> places) {
  std::vector<Sighting> sightings;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const bool in_own = places[k]->mapped == MapSide::kOwn;
    const PlaceView* query = places[k]->place.query.get();
    for (const CommonPoint& common : places[k]->place.points) {
      const PlaceView* mapped = common.mapped.get();
      if (mapped->Knows(common.mapped_point)) {
        sightings.push_back({in_own, mapped->points_in_world[common.mapped_point], query,
                             query->described[common.query_point].pixel, static_cast<int>(k)});
      }
      if (query->Knows(common.query_point)) {
        sightings.push_back({!in_own, query->points_in_world[common.query_point], mapped,
                             mapped->described[common.mapped_point].pixel, static_cast<int>(k)});
      }
    }
  }
  return sightings;
}

/// Error [px at 640] and its derivative by a change on the left; nothing behind the camera.
std::optional<Eigen::Vector2d> Error(const Sighting& sighting, const Similarity3& own_from_other,
                                     Eigen::Matrix<double, 2, 7>* by_change) {
  const Rigid3 camera_from_world = sighting.seen_by->world_from_camera().Inverse();
  Eigen::Vector3d moved;
  Eigen::Matrix<double, 3, 7> by;
  if (sighting.own_point) {
    const Similarity3 other_from_own = own_from_other.Inverse();
    moved = other_from_own * sighting.point;
    by << Eigen::Matrix3d::Identity(), -Skew(sighting.point), sighting.point;
    by = -other_from_own.scale * other_from_own.rotation.toRotationMatrix() * by.eval();
  } else {
    moved = own_from_other * sighting.point;
    by << Eigen::Matrix3d::Identity(), -Skew(moved), moved;
  }
  Eigen::Matrix<double, 2, 3> by_point;
  const CameraModel& camera = *sighting.seen_by->camera;
  const auto pixel = camera.Project(camera_from_world * moved, &by_point);
  if (!pixel) return std::nullopt;
  const double unit = 640.0 / camera.width();
  if (by_change != nullptr) *by_change = unit * by_point * camera_from_world.RotationMatrix() * by;
  return unit * (*pixel - sighting.pixel);
}

Similarity3 Changed(const Similarity3& by, const Vector7d& change) {
  Similarity3 left;
  left.scale = std::exp(change[6]);
  left.rotation = ExpQuaternion(change.segment<3>(3));
  left.translation = change.head<3>();
  return left * by;
}

struct Equations {
  Matrix7d hessian = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
  std::vector<Vector7d> by_cluster;
  double squared = 0.0, loss = 0.0;
  int agree = 0;
};

Equations Build(const std::vector<Sighting>& sightings, const Similarity3& at, bool metric,
                std::size_t clusters) {
  Equations equations;
  equations.by_cluster.assign(clusters, Vector7d::Zero());
  for (const Sighting& sighting : sightings) {
    Eigen::Matrix<double, 2, 7> by;
    const auto error = Error(sighting, at, &by);
    if (!error) continue;
    if (metric) by.col(6).setZero();
    const double size = error->norm();
    const double weight = size <= kHuber_px ? 1.0 : kHuber_px / size;
    equations.loss += size <= kHuber_px ? 0.5 * size * size : kHuber_px * (size - 0.5 * kHuber_px);
    equations.hessian += weight * by.transpose() * by;
    const Vector7d part = weight * by.transpose() * *error;
    equations.gradient += part;
    equations.by_cluster[sighting.cluster] += part;
    if (size > kAgrees_px) continue;
    ++equations.agree;
    equations.squared += size * size;
  }
  if (metric) equations.hessian(6, 6) = 1.0;
  return equations;
}

}  // namespace

std::optional<MapFit> FitMaps(std::span<const JoinedPlace* const> places,
                              const Similarity3& initial, bool metric) {
  const std::vector<Sighting> sightings = Collect(places);
  Similarity3 at = initial;
  Equations now = Build(sightings, at, metric, places.size());
  double damping = 1e-6;
  for (int k = 0; k < kIterations; ++k) {
    Matrix7d damped = now.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix7d> solver(damped);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
    const Vector7d change = -solver.solve(now.gradient);
    if (!change.allFinite() || change.tail<4>().norm() > 1.0) return std::nullopt;
    const Similarity3 next = Changed(at, change);
    Equations there = Build(sightings, next, metric, places.size());
    if (there.loss > now.loss) {
      damping *= 100.0;
      continue;
    }
    at = next;
    now = std::move(there);
    if (change.norm() < 1e-9) break;
  }
  if (now.agree < kFewest) return std::nullopt;
  const Matrix7d inverse = now.hessian.inverse();
  if (!inverse.allFinite()) return std::nullopt;
  MapFit fit;
  fit.own_from_other = at;
  fit.points = now.agree;
  fit.rms_px = std::sqrt(now.squared / now.agree);
  Matrix7d between = Matrix7d::Zero();
  for (const Vector7d& part : now.by_cluster) between += part * part.transpose();
  const double few = static_cast<double>(places.size()) / std::max(1.0, places.size() - 1.0);
  const double sigma = std::max(kSigma_px, fit.rms_px);
  fit.covariance = sigma * sigma * inverse + few * inverse * between * inverse;
  if (metric) {
    fit.covariance.row(6).setZero();
    fit.covariance.col(6).setZero();
  }
  return fit;
}

}  // namespace saccade
