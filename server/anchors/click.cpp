#include "server/anchors/click.hpp"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "server/anchors/local_surface.hpp"
#include "server/anchors/rigid_fit.hpp"
#include "server/anchors/surface_look.hpp"
#include "shared/scene/limits.hpp"

namespace saccade {
namespace {

constexpr double kRayRadiansPerPx = 1.0 / 500;  // a ray has no camera: an ordinary one is assumed
constexpr double kPointSigmaM = 0.001;  // a point given in world is exact; what is drawn is not
constexpr double kFailedTrust = 0.3;    // searched for and not found: perhaps hidden

std::string DescribeStatus(const MapSnapshot& snapshot) {
  switch (snapshot.status) {
    case TrackingStatus::kInitialising:
      return "the map was still starting";
    case TrackingStatus::kLost:
      return "tracking was lost";
    case TrackingStatus::kRelocalising:
      return "tracking was being recovered";
    default:
      return "tracking";
  }
}

bool IsTracked(const MapSnapshot& snapshot) {
  return snapshot.status == TrackingStatus::kTracking ||
         snapshot.status == TrackingStatus::kCoasting;
}

Eigen::Matrix3d AlongAndAcross(const Eigen::Vector3d& ray, double along, double across) {
  const Eigen::Matrix3d projector = ray * ray.transpose();
  return along * along * projector + across * across * (Eigen::Matrix3d::Identity() - projector);
}

absl::Status CheckPixel(const PixelTarget& target, const CameraModel& camera) {
  const Eigen::Vector2d& pixel = target.pixel;
  if (!pixel.allFinite()) {
    return absl::InvalidArgumentError(
        "target.frame_pixel.pixel is not a finite number; give u and v in pixels of the raw "
        "picture");
  }
  if (!camera.InImage(pixel, -0.5)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "target.frame_pixel.pixel (%.1f, %.1f) is outside the picture, which is %d x %d; click "
        "inside it",
        pixel.x(), pixel.y(), camera.width(), camera.height()));
  }
  return absl::OkStatus();
}

absl::Status CheckFrame(const PastFrame& past, const MapSnapshot& newest) {
  if (!IsTracked(*past.snapshot)) {
    return absl::FailedPreconditionError(
        absl::StrCat("in frame ", past.frame->id, " ", DescribeStatus(*past.snapshot),
                     ", so its pose is not known; click in a picture whose status is tracking"));
  }
  if (past.snapshot->map_generation != newest.map_generation) {
    return absl::FailedPreconditionError(
        absl::StrCat("the map was reset after frame ", past.frame->id, "; click again"));
  }
  return absl::OkStatus();
}

absl::Status NoDepth() {
  return absl::FailedPreconditionError(
      "the map has no depth for any feature in that view yet; move the camera sideways and click "
      "again");
}

/// What surfaces have on the ray, or, where that is a hole, around it: as further samples.
std::optional<SurfaceLook> LookAt(const MapView& newest, const Rigid3& ray_from_world,
                                  double radians_per_px, std::vector<SurfaceSample>& samples) {
  if (newest.surface() == nullptr) return std::nullopt;
  const Rigid3 world_from_ray = ray_from_world.Inverse();
  std::optional<SurfaceLook> look =
      LookAtSurface(*newest.surface(), world_from_ray.translation,
                    world_from_ray.rotation * Eigen::Vector3d::UnitZ(), radians_per_px);
  if (look) return look;
  const auto around = SurfaceAround(*newest.surface(), ray_from_world, radians_per_px);
  samples.insert(samples.end(), around.begin(), around.end());
  return std::nullopt;
}

/// Where no feature is in view.
SurfaceDepth GuessOf(const SurfaceLook& look) {
  SurfaceDepth depth;
  depth.depth_m = look.range_m;
  depth.sigma_m = look.range_m;
  return depth;
}

/// The features that were in view, as the newest map has them, seen from the clicked frame.
std::vector<SurfaceSample> VisibleSamples(const MapSnapshot& past, const MapView& newest,
                                          const Rigid3& newest_from_past,
                                          const Rigid3& ray_from_world,
                                          std::vector<FeatureId>& ids) {
  std::vector<SurfaceSample> samples;
  for (const FeatureSnapshot& feature : past.features) {
    if (!feature.pixel) continue;
    const FeatureSnapshot* now = newest.Find(feature.id);
    const Eigen::Vector3d in_world =
        now ? now->point_in_world : newest_from_past * feature.point_in_world;
    SurfaceSample sample;
    sample.point_in_ray = ray_from_world * in_world;
    sample.depth_known = now ? now->depth_known : feature.depth_known;
    const Eigen::Vector3d bearing =
        (past.world_from_camera.Inverse() * feature.point_in_world).normalized();
    double variance = bearing.dot(feature.covariance_in_camera * bearing);
    if (now) {
      const double before = feature.covariance_in_world.trace();
      if (before > 0) variance *= std::min(1.0, now->covariance_in_world.trace() / before);
    }
    sample.depth_sigma_m = std::sqrt(std::max(0.0, variance));
    sample.trust = feature.state == FeatureState::kFailed ? kFailedTrust : 1.0;
    samples.push_back(sample);
    ids.push_back(feature.id);
  }
  return samples;
}

/// Any rotation that takes the ray to +z.
Rigid3 RayFromWorld(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray_in_world) {
  Rigid3 world_from_ray;
  world_from_ray.rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ray_in_world).normalized();
  world_from_ray.translation = origin;
  return world_from_ray.Inverse();
}

absl::StatusOr<ResolvedTarget> ResolvePixel(const PixelTarget& target, const FrameLookup& frames,
                                            const MapView& newest, const AnchorOptions& options,
                                            ClickCare care) {
  absl::StatusOr<PixelRay> cast = CastPixel(target, frames, newest);
  if (!cast.ok()) return cast.status();
  const MapSnapshot& then = *cast->past.snapshot;
  const CameraModel& camera = *cast->past.frame->camera;
  const Rigid3& world_from_camera = cast->world_from_camera;
  const Eigen::Vector3d& ray = cast->ray_in_world;
  const Rigid3 ray_from_world = RayFromWorld(world_from_camera.translation, ray);

  std::vector<FeatureId> ids;
  std::vector<SurfaceSample> samples =
      VisibleSamples(then, newest, cast->newest_from_past, ray_from_world, ids);
  const std::optional<SurfaceLook> look =
      LookAt(newest, ray_from_world, camera.RadiansPerPixel(), samples);
  std::optional<SurfaceDepth> depth =
      EstimateDepth(samples, camera.RadiansPerPixel(), newest.snapshot().metric, options);
  if (!depth && look) depth = GuessOf(*look);
  if (!depth) return NoDepth();

  ResolvedTarget resolved;
  if (care == ClickCare::kFull) {
    resolved.doubt = AskThePicture(cast->past, target.pixel, newest.snapshot().frame_id, frames,
                                   newest.trail(), *depth);
  }
  if (look) TakeSurface(*look, *depth, resolved.doubt);
  if (!look && samples.size() > ids.size()) DoubtHole(*depth, resolved.doubt);
  resolved.method = depth->method;
  resolved.distance_m = depth->depth_m;
  resolved.point_in_world = world_from_camera.translation + depth->depth_m * ray;
  double across = options.click_sigma_px * camera.RadiansPerPixel() * depth->depth_m;
  if (then.status == TrackingStatus::kCoasting) {  // the pose is a prediction
    across = std::hypot(
        across, std::sqrt(then.pose_covariance.diagonal().head<3>().maxCoeff()),
        depth->depth_m * std::sqrt(then.pose_covariance.diagonal().tail<3>().maxCoeff()));
  }
  resolved.covariance_in_world = AlongAndAcross(ray, depth->sigma_m, across);
  if (depth->at_feature && *depth->at_feature < ids.size() &&
      newest.Find(ids[*depth->at_feature])) {
    resolved.feature = ids[*depth->at_feature];
  }
  resolved.normal_in_world =
      look && !look->outline
          ? look->normal_in_world
          : Eigen::Vector3d(ray_from_world.rotation.conjugate() * depth->normal_in_ray);
  resolved.view = ResolvedTarget::View{std::move(cast->past), world_from_camera, target.pixel,
                                       depth->depth_m, depth->sigma_m};
  return resolved;
}

absl::StatusOr<ResolvedTarget> ResolveFeature(const FeatureTarget& target, const MapView& newest) {
  const FeatureSnapshot* feature = newest.Find(target.feature_id);
  if (!feature) {
    return absl::NotFoundError(
        absl::StrCat("target.feature_id ", target.feature_id,
                     " is not in the map (any more); choose a feature of the newest map"));
  }
  ResolvedTarget resolved;
  resolved.method = AnchorMethod::kFeature;
  resolved.point_in_world = feature->point_in_world;
  resolved.covariance_in_world = feature->covariance_in_world;
  resolved.feature = feature->id;
  resolved.feature_is_target = true;
  return resolved;
}

absl::StatusOr<ResolvedTarget> ResolvePoint(const PointTarget& target) {
  const Eigen::Vector3d& point = target.point_in_world;
  if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kMaxCoordinateM) {
    return absl::InvalidArgumentError(
        "target.point_in_world_m is not finite or more than 10 km away; give metres in world");
  }
  ResolvedTarget resolved;
  resolved.method = AnchorMethod::kPoint;
  resolved.point_in_world = point;
  resolved.covariance_in_world = kPointSigmaM * kPointSigmaM * Eigen::Matrix3d::Identity();
  return resolved;
}

absl::StatusOr<ResolvedTarget> ResolveRay(const RayTarget& target, const MapView& newest,
                                          const AnchorOptions& options) {
  const double length = target.direction_in_world.norm();
  if (!target.origin_in_world.allFinite() || !(length > 1e-9) || !(length < 1e9) ||
      target.origin_in_world.cwiseAbs().maxCoeff() > kMaxCoordinateM) {
    return absl::InvalidArgumentError(
        "target.ray is not finite or has no direction; give an origin in metres and a direction "
        "with a length above 0");
  }
  const Eigen::Vector3d ray = target.direction_in_world / length;
  const Rigid3 ray_from_world = RayFromWorld(target.origin_in_world, ray);
  std::vector<SurfaceSample> samples;
  std::vector<FeatureId> ids;
  for (const FeatureSnapshot& feature : newest.snapshot().features) {
    if (newest.Find(feature.id) != &feature) continue;
    SurfaceSample sample;
    sample.point_in_ray = ray_from_world * feature.point_in_world;
    sample.depth_sigma_m = std::sqrt(std::max(0.0, ray.dot(feature.covariance_in_world * ray)));
    sample.depth_known = feature.depth_known;
    samples.push_back(sample);
    ids.push_back(feature.id);
  }
  const std::optional<SurfaceLook> look = LookAt(newest, ray_from_world, kRayRadiansPerPx, samples);
  std::optional<SurfaceDepth> depth =
      EstimateDepth(samples, kRayRadiansPerPx, newest.snapshot().metric, options);
  if (!depth && look) depth = GuessOf(*look);
  if (!depth) return NoDepth();
  ResolvedTarget resolved;
  if (look) TakeSurface(*look, *depth, resolved.doubt);
  if (!look && samples.size() > ids.size()) DoubtHole(*depth, resolved.doubt);
  resolved.method = depth->method;
  resolved.point_in_world = target.origin_in_world + depth->depth_m * ray;
  resolved.covariance_in_world = AlongAndAcross(
      ray, depth->sigma_m, options.click_sigma_px * kRayRadiansPerPx * depth->depth_m);
  if (depth->at_feature && *depth->at_feature < ids.size()) {
    resolved.feature = ids[*depth->at_feature];
  }
  resolved.normal_in_world =
      look && !look->outline
          ? look->normal_in_world
          : Eigen::Vector3d(ray_from_world.rotation.conjugate() * depth->normal_in_ray);
  return resolved;
}

}  // namespace

absl::StatusOr<PixelRay> CastPixel(const PixelTarget& target, const FrameLookup& frames,
                                   const MapView& newest) {
  if (!target.pixel.allFinite()) return CheckPixel(target, CameraModel());
  absl::StatusOr<PastFrame> past = frames(target.frame_id);
  if (!past.ok()) return past.status();
  const CameraModel& camera = *past->frame->camera;
  if (absl::Status status = CheckPixel(target, camera); !status.ok()) return status;
  if (absl::Status status = CheckFrame(*past, newest.snapshot()); !status.ok()) return status;
  const std::optional<Eigen::Vector3d> bearing = camera.Unproject(target.pixel);
  if (!bearing) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "target.frame_pixel.pixel (%.1f, %.1f) lies where the lens model cannot be inverted; click "
        "nearer to the middle of the picture",
        target.pixel.x(), target.pixel.y()));
  }
  PixelRay cast;
  const MapSnapshot& then = *past->snapshot;
  cast.newest_from_past = NewestFromPast(then, newest, then.world_from_camera.rotation * *bearing);
  cast.world_from_camera = cast.newest_from_past * then.world_from_camera;
  cast.ray_in_world = (cast.world_from_camera.rotation * *bearing).normalized();
  cast.past = *std::move(past);
  return cast;
}

Rigid3 NewestFromPast(const MapSnapshot& before, const MapView& newest,
                      const Eigen::Vector3d& ray_in_world) {
  if (&before == &newest.snapshot()) return {};
  constexpr std::size_t kMinPairs = 6;
  std::vector<WeightedPair> pairs;
  for (const FeatureSnapshot& feature : before.features) {
    const FeatureSnapshot* now = newest.Find(feature.id);
    if (!now || !now->depth_known || !feature.depth_known) continue;
    const Eigen::Vector3d to = feature.point_in_world - before.world_from_camera.translation;
    const double sine2 = 1.0 - std::pow(std::max(0.0, to.normalized().dot(ray_in_world)), 2);
    const double sigma2 = feature.covariance_in_world.trace() / 3.0 + 1e-8;
    const double weight = 1.0 / (sigma2 * (sine2 + 0.01));
    if (!std::isfinite(weight)) continue;
    pairs.push_back({feature.point_in_world, now->point_in_world, weight});
  }
  return pairs.size() < kMinPairs ? Rigid3{} : FitRigid(pairs);
}

absl::StatusOr<ResolvedTarget> ResolveTarget(const AnnotationTarget& target,
                                             const FrameLookup& frames, const MapView& newest,
                                             const AnchorOptions& options, ClickCare care) {
  absl::StatusOr<ResolvedTarget> resolved;
  if (const auto* pixel = std::get_if<PixelTarget>(&target)) {
    return ResolvePixel(*pixel, frames, newest, options, care);
  }
  if (const auto* feature = std::get_if<FeatureTarget>(&target)) {
    resolved = ResolveFeature(*feature, newest);
  } else if (const auto* point = std::get_if<PointTarget>(&target)) {
    resolved = ResolvePoint(*point);
  } else {
    resolved = ResolveRay(std::get<RayTarget>(target), newest, options);
  }
  if (!resolved.ok()) return resolved;
  const Eigen::Vector3d camera = newest.snapshot().world_from_camera.translation;
  resolved->distance_m = std::max(1e-3, (resolved->point_in_world - camera).norm());
  return resolved;
}

}  // namespace saccade
