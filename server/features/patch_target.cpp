#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/features/search.hpp"
#include "server/features/target_detector.hpp"
#include "shared/geometry/so3.hpp"

namespace saccade {
namespace {

/// Least uncertainty granted to a start pose: nobody places a camera better by hand.
constexpr double kLeastPositionSigma = 0.005;     // [m]
constexpr double kLeastOrientationSigma = 0.015;  // [rad]
constexpr double kAgreePx = 3.0;                  // points within this of a pose support it
constexpr double kSecondSigmaPx = 2.0;            // of the search around the first pose
constexpr int kMaxTriples = 400;

struct Match {
  int index = 0;  // into the target's points
  Eigen::Vector2d pixel;
};

PoseFitOptions FitOptions(const StartPose& start) {
  PoseFitOptions options;
  options.sigma_px = 0.3;
  options.prior_position_sigma_m = std::max(start.position_sigma_m, kLeastPositionSigma);
  options.prior_orientation_sigma_rad =
      std::max(start.orientation_sigma_rad, kLeastOrientationSigma);
  return options;
}

/// Innovation covariance [px^2] of a known point under the start pose's uncertainty.
Eigen::Matrix2d Innovation(const Eigen::Matrix<double, 2, 3>& by_point,
                           const Eigen::Vector3d& point_in_camera, const PoseFitOptions& prior) {
  const Eigen::Matrix<double, 2, 3> by_turn = by_point * Skew(point_in_camera);
  return std::pow(prior.prior_position_sigma_m, 2) * by_point * by_point.transpose() +
         std::pow(prior.prior_orientation_sigma_rad, 2) * by_turn * by_turn.transpose() +
         Eigen::Matrix2d::Identity();
}

/// Patches found around their prediction from `pose`; `sigma_px` above zero replaces the ellipse
/// that follows from the prior.
std::vector<Match> Search(const ImagePyramid& pyramid, const CameraModel& camera,
                          const PatchTarget& target, const std::vector<PatchTemplate>& templates,
                          const Rigid3& pose, const PoseFitOptions& prior, double sigma_px,
                          PatchSearcher& searcher) {
  std::vector<Match> matches;
  for (std::size_t k = 0; k < templates.size(); ++k) {
    const Eigen::Vector3d point = pose.Inverse() * target.points[k].point_in_world;
    Eigen::Matrix<double, 2, 3> by_point;
    const auto predicted = camera.Project(point, &by_point);
    if (!predicted) continue;
    WarpedPatch patch;
    if (CopyPatch(templates[k], {.size = 15, .min_deviation = 5.0}, patch) != WarpStatus::kOk) {
      continue;
    }
    const Eigen::Matrix2d covariance =
        sigma_px > 0 ? Eigen::Matrix2d(Eigen::Matrix2d::Identity() * sigma_px * sigma_px)
                     : Innovation(by_point, point, prior);
    const SearchResult result = searcher.Find(pyramid, patch, *predicted, covariance);
    if (result.found()) matches.push_back({static_cast<int>(k), result.pixel});
  }
  return matches;
}

absl::StatusOr<PoseFit> Fit(const CameraModel& camera, const PatchTarget& target,
                            const std::vector<Match>& matches, const Rigid3& initial,
                            const PoseFitOptions& options) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const Match& match : matches) {
    points.push_back(target.points[match.index].point_in_world);
    pixels.push_back(match.pixel);
  }
  return FitPose(camera, points, pixels, initial, options);
}

std::vector<Match> Supporters(const CameraModel& camera, const PatchTarget& target,
                              const std::vector<Match>& matches, const Rigid3& pose) {
  std::vector<Match> agreeing;
  for (const Match& match : matches) {
    const auto seen = camera.Project(pose.Inverse() * target.points[match.index].point_in_world);
    if (seen && (*seen - match.pixel).norm() < kAgreePx) agreeing.push_back(match);
  }
  return agreeing;
}

/// The largest set of matches that one pose near the start explains.
std::vector<Match> Consistent(const CameraModel& camera, const PatchTarget& target,
                              const std::vector<Match>& matches, const Rigid3& start,
                              const PoseFitOptions& options) {
  std::vector<Match> best;
  const std::size_t count = matches.size();
  int tried = 0;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      for (std::size_t c = b + 1; c < count && tried < kMaxTriples; ++c, ++tried) {
        const auto fit = Fit(camera, target, {matches[a], matches[b], matches[c]}, start, options);
        if (!fit.ok()) continue;
        std::vector<Match> agreeing = Supporters(camera, target, matches, fit->world_from_camera);
        if (agreeing.size() > best.size()) best = std::move(agreeing);
      }
    }
  }
  return best;
}

}  // namespace

absl::StatusOr<std::vector<PatchTemplate>> PatchTemplates(
    const PatchTarget& target, const Rigid3& world_from_camera,
    const std::shared_ptr<const CameraModel>& camera) {
  if (camera == nullptr) return absl::InvalidArgumentError("patch target: no camera");
  std::vector<PatchTemplate> templates;
  for (const KnownPatch& known : target.points) {
    const auto pixel = camera->Project(world_from_camera.Inverse() * known.point_in_world);
    if (!pixel) {
      return absl::FailedPreconditionError(absl::StrCat(
          "target.yaml: point ", known.id,
          " is not in front of the start pose; check point_in_world_m and start.yaml"));
    }
    auto patch = PatchFromImage(known.templ, *pixel, camera);
    if (!patch.ok()) {
      return absl::Status(patch.status().code(), absl::StrCat("target.yaml: point ", known.id, ": ",
                                                              patch.status().message()));
    }
    templates.push_back(*std::move(patch));
  }
  return templates;
}

absl::StatusOr<TargetObservation> DetectPatches(const ImagePyramid& pyramid,
                                                const std::shared_ptr<const CameraModel>& camera,
                                                const PatchTarget& target, const StartPose& start,
                                                const PatchTargetOptions& options) {
  const auto templates = PatchTemplates(target, start.world_from_camera, camera);
  if (!templates.ok()) return templates.status();
  if (pyramid.empty()) return absl::InvalidArgumentError("patch target: no picture");
  SearchOptions search_options;
  search_options.max_nssd = options.max_nssd;
  search_options.max_sigma_px = options.max_sigma_px;
  PatchSearcher searcher(search_options);
  const PoseFitOptions fit_options = FitOptions(start);

  const auto wide = Search(pyramid, *camera, target, *templates, start.world_from_camera,
                           fit_options, 0.0, searcher);
  const auto too_few = [&](std::size_t found) {
    return absl::NotFoundError(absl::StrCat("patch target: ", found, " of ", target.points.size(),
                                            " patches found near the start pose, ",
                                            options.min_points, " needed"));
  };
  const auto least = static_cast<std::size_t>(std::max(3, options.min_points));
  const auto agreeing = Consistent(*camera, target, wide, start.world_from_camera, fit_options);
  if (agreeing.size() < least) return too_few(agreeing.size());
  auto fit = Fit(*camera, target, agreeing, start.world_from_camera, fit_options);
  if (!fit.ok()) return fit.status();

  // The rest may have been found elsewhere: look again where this pose expects them.
  const auto narrow =
      Supporters(*camera, target,
                 Search(pyramid, *camera, target, *templates, fit->world_from_camera, fit_options,
                        kSecondSigmaPx, searcher),
                 fit->world_from_camera);
  if (narrow.size() < least) return too_few(narrow.size());
  fit = Fit(*camera, target, narrow, start.world_from_camera, fit_options);
  if (!fit.ok()) return fit.status();

  TargetObservation seen;
  for (const Match& match : narrow) {
    seen.ids.push_back(target.points[match.index].id);
    seen.pixels.push_back(match.pixel);
    seen.points_in_world.push_back(target.points[match.index].point_in_world);
  }
  seen.world_from_camera = fit->world_from_camera;
  seen.pose_covariance = fit->covariance;
  seen.rms_px = fit->rms_px;
  return seen;
}

}  // namespace saccade
