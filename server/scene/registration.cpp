#include "server/scene/registration.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace saccade {
namespace {

constexpr std::size_t kLeastPairs = 4;
constexpr double kLeastRatio = 0.05;  // of the spread across the longest line to that along it

using Points = Eigen::Matrix3Xd;

/// Root mean square spreads along the principal directions, least first.
Eigen::Vector3d Spreads(const Points& points) {
  const Points centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d scatter =
      centred * centred.transpose() / static_cast<double>(points.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

absl::Status CheckSpread(const Points& points, const char* where, double least_m) {
  const Eigen::Vector3d spreads = Spreads(points);
  if (spreads.z() >= least_m && spreads.y() >= least_m &&
      spreads.y() >= kLeastRatio * spreads.z()) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrCat(
      "correspondences: in the ", where, " they lie within ", std::lround(1e3 * spreads.y()),
      " mm of one line; choose points farther apart, not in a row"));
}

Similarity3 Fit(const Points& model, const Points& map, bool with_scale) {
  // Of dynamic size: GCC 12 warns falsely about the fixed one.
  const Eigen::MatrixXd fit =
      Eigen::umeyama(Eigen::MatrixXd(model), Eigen::MatrixXd(map), with_scale);
  Similarity3 result;
  const Eigen::Matrix3d linear = fit.topLeftCorner<3, 3>();
  result.scale = with_scale ? std::cbrt(linear.determinant()) : 1.0;
  result.rotation = Eigen::Quaterniond(Eigen::Matrix3d(linear / result.scale)).normalized();
  result.translation = fit.topRightCorner<3, 1>();
  return result;
}

double Rms(const std::vector<double>& errors) {
  double sum = 0;
  for (const double error : errors) sum += error * error;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

Points Without(const Points& points, Eigen::Index left_out) {
  Points rest(3, points.cols() - 1);
  rest << points.leftCols(left_out), points.rightCols(points.cols() - 1 - left_out);
  return rest;
}

double RmsOf(const Similarity3& fit, const Points& model, const Points& map) {
  double sum = 0;
  for (Eigen::Index i = 0; i < model.cols(); ++i) {
    sum += (fit * Eigen::Vector3d(model.col(i)) - map.col(i)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(model.cols()));
}

/// Points that are no plane fit their mirror picture far worse, or far better.
absl::Status CheckMirror(const Points& model, const Points& map, bool with_scale, double rms_m) {
  if (Spreads(model).x() < kLeastRatio * Spreads(model).z()) return absl::OkStatus();
  Points mirrored = model;
  mirrored.row(0) *= -1.0;
  if (RmsOf(Fit(mirrored, map, with_scale), mirrored, map) > 0.2 * rms_m) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "correspondences: the map shows the model mirrored; check which point is which, and whether "
      "the model or the picture was turned over");
}

}  // namespace

absl::StatusOr<Registration> Register(std::span<const PointPair> pairs,
                                      const RegistrationOptions& options) {
  if (pairs.size() < kLeastPairs) {
    return absl::InvalidArgumentError(
        absl::StrCat("correspondences: ", pairs.size(), "; give at least ", kLeastPairs));
  }
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Points model(3, count), map(3, count);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    model.col(static_cast<Eigen::Index>(i)) = pairs[i].point_in_model;
    map.col(static_cast<Eigen::Index>(i)) = pairs[i].point_in_map;
    if (!pairs[i].point_in_model.allFinite() || !pairs[i].point_in_map.allFinite()) {
      return absl::InvalidArgumentError(
          absl::StrCat("correspondences[", i, "]: not a finite number"));
    }
  }
  // A map without metres has no least spread of its own.
  const double least_in_map_m = options.with_scale ? 0.0 : options.least_spread_m;
  absl::Status spread = CheckSpread(model, "model", options.least_spread_m);
  if (spread.ok()) spread = CheckSpread(map, "map", least_in_map_m);
  if (!spread.ok()) return spread;

  Registration result;
  result.map_from_model = Fit(model, map, options.with_scale);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Points model_rest = Without(model, i), map_rest = Without(map, i);
    spread = CheckSpread(model_rest, "model, without one of them,", options.least_spread_m);
    if (spread.ok()) spread = CheckSpread(map_rest, "map, without one of them,", least_in_map_m);
    if (!spread.ok()) return spread;
    const Eigen::Vector3d point = model.col(i);
    result.errors_m.push_back((result.map_from_model * point - map.col(i)).norm());
    const Similarity3 others = Fit(model_rest, map_rest, options.with_scale);
    result.left_out_errors_m.push_back((others * point - map.col(i)).norm());
  }
  result.rms_m = Rms(result.errors_m);
  result.left_out_rms_m = Rms(result.left_out_errors_m);
  const absl::Status mirror = CheckMirror(model, map, options.with_scale, result.rms_m);
  if (!mirror.ok()) return mirror;
  return result;
}

}  // namespace saccade
