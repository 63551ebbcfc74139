#include "server/tracker/starter.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

// A hand that has just picked the camera up.
constexpr double kVelocitySigma_m_s = 0.3;
constexpr double kStartedSpinSigma_rad_s = 0.5;

Matrix12d MotionCovariance(const Matrix6d& pose, double velocity, double angular_velocity) {
  Matrix12d covariance = Matrix12d::Zero();
  covariance.topLeftCorner<6, 6>() = pose;
  covariance.diagonal().segment<3>(6).setConstant(velocity * velocity);
  covariance.diagonal().segment<3>(9).setConstant(angular_velocity * angular_velocity);
  return covariance;
}

Births::DepthGuess AtMedianRange(std::span<const Eigen::Vector3d> points, const Rigid3& pose) {
  std::vector<double> ranges;
  for (const Eigen::Vector3d& point : points) ranges.push_back((point - pose.translation).norm());
  std::nth_element(ranges.begin(), ranges.begin() + ranges.size() / 2, ranges.end());
  const double inverse = 1.0 / std::max(1e-3, ranges[ranges.size() / 2]);
  return {inverse, 0.5 * inverse};
}

void AddKnown(const PatchTemplate& patch, const Eigen::Vector3d& point, const Rigid3& seen_from,
              LandmarkMap& map) {
  Landmark landmark;
  landmark.id = map.NextId();
  landmark.patch = patch;
  landmark.known = Landmark::Known{point, seen_from};
  map.Add(std::move(landmark));
}

}  // namespace

absl::Status Starter::Check(const SourceInfo& source) {
  if (source.camera == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("source ", source.uri, ": has no camera; give camera.yaml"));
  }
  if (!source.target) return absl::OkStatus();
  if (const auto* patches = std::get_if<PatchTarget>(&*source.target)) {
    if (patches->points.size() < 3 || !source.start) {
      return absl::InvalidArgumentError(
          absl::StrCat("source ", source.uri,
                       ": target.yaml of type patches needs at least 3 points and a start.yaml"));
    }
  }
  return absl::OkStatus();
}

bool Starter::waits_for_target() const {
  return source_.target.has_value() && waited_ < options_.target_frames;
}

bool Starter::TargetExpired(std::int64_t frames_since_start) const {
  return source_.target && std::holds_alternative<ChessboardTarget>(*source_.target) &&
         frames_since_start >= options_.target_frames;
}

std::optional<Start> Starter::Try(FrontEnd& front_end, FilterState& filter, LandmarkMap& map) {
  if (!waits_for_target()) return Free(filter);
  ++waited_;
  return std::holds_alternative<ChessboardTarget>(*source_.target)
             ? TryChessboard(front_end, filter, map)
             : TryPatches(front_end, filter, map);
}

std::optional<Start> Starter::TryChessboard(FrontEnd& front_end, FilterState& filter,
                                            LandmarkMap& map) {
  const auto& target = std::get<ChessboardTarget>(*source_.target);
  std::optional<Rigid3> predicted;
  if (source_.start) predicted = source_.start->world_from_camera;
  const auto seen = front_end.FindChessboard(target, predicted);
  if (!seen.ok() || seen->ambiguous) return std::nullopt;
  CameraMotion camera;
  camera.world_from_camera = seen->world_from_camera;
  filter.Reset(
      camera, MotionCovariance(seen->pose_covariance, kVelocitySigma_m_s, kStartedSpinSigma_rad_s));
  for (std::size_t k = 0; k < seen->pixels.size(); ++k) {
    const auto patch = front_end.Cut(seen->pixels[k]);
    if (patch) AddKnown(*patch, seen->points_in_world[k], seen->world_from_camera, map);
  }
  return Start{true, AtMedianRange(seen->points_in_world, seen->world_from_camera)};
}

std::optional<Start> Starter::TryPatches(FrontEnd& front_end, FilterState& filter,
                                         LandmarkMap& map) {
  const auto& target = std::get<PatchTarget>(*source_.target);
  const StartPose& start = *source_.start;
  const auto patches = front_end.FindPatches(target, start);
  if (!patches.ok()) return std::nullopt;
  const TargetObservation& seen = patches->observation;
  CameraMotion camera;
  camera.world_from_camera = seen.world_from_camera;
  camera.velocity_m_s = start.velocity_m_s;
  camera.angular_velocity_rad_s = start.angular_velocity_rad_s;
  filter.Reset(camera, MotionCovariance(seen.pose_covariance, start.velocity_sigma_m_s,
                                        start.angular_velocity_sigma_rad_s));
  std::vector<Eigen::Vector3d> points;
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    points.push_back(target.points[k].point_in_world);
    AddKnown(patches->looks[k], points.back(), start.world_from_camera, map);
  }
  return Start{true, AtMedianRange(points, seen.world_from_camera)};
}

std::optional<Start> Starter::Free(FilterState& filter) const {
  const double unit = options_.initial_depth_m;
  filter.Reset(CameraMotion(), MotionCovariance(Matrix6d::Zero(), kVelocitySigma_m_s * unit,
                                                kStartedSpinSigma_rad_s));
  return Start{false, {1.0 / unit, 0.5 / unit}};
}

}  // namespace saccade
