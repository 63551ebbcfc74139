#include "client/tools/landing.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "client/tools/plane.hpp"

namespace saccade::tools {
namespace {

constexpr double kFeaturePx = 20;  // as the server's: such a feature gives its depth
constexpr double kSnapPx = 6;      // in the map, a click this near to a feature means itself
constexpr double kNearPx = 120;
constexpr double kPlaneResidualM = 0.02, kGuessedDepthM = 1;

struct Seen {
  const FeatureSnapshot* feature = nullptr;
  double depth_m = 0, away_px = 0;
};

/// Features in front of the eye, nearest to the click first.
std::vector<Seen> SeenFrom(const View& view, const Eigen::Vector2d& click,
                           const Features& features) {
  std::vector<Seen> seen;
  for (const auto& [id, feature] : features) {
    if (!feature.depth_known) continue;
    const auto pixel = view.Project(feature.point_in_world);
    if (!pixel) continue;
    seen.push_back({&feature, view.Depth(feature.point_in_world), (*pixel - click).norm()});
  }
  std::sort(seen.begin(), seen.end(),
            [](const Seen& a, const Seen& b) { return a.away_px < b.away_px; });
  return seen;
}

double Sigma(const FeatureSnapshot& feature) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(feature.covariance_in_world,
                                                            Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(axes.eigenvalues()[2], 0.0));
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The point of a ray that is `depth_m` in front of the eye.
Eigen::Vector3d AtDepth(const View& view, const Eigen::Vector3d& direction, double depth_m) {
  return view.eye() + direction * (depth_m / view.Depth(view.eye() + direction));
}

std::optional<Landing> OnPlane(const View& view, const Eigen::Vector3d& direction,
                               const std::vector<Seen>& seen, double near_px) {
  std::vector<Eigen::Vector3d> points;
  std::vector<double> depths, sigmas;
  for (const Seen& each : seen) {
    if (each.away_px > near_px || points.size() == 6) break;
    points.push_back(each.feature->point_in_world);
    depths.push_back(each.depth_m);
    sigmas.push_back(Sigma(*each.feature));
  }
  const std::optional<Plane> plane = FitPlane(points);
  if (!plane || plane->residual_m > kPlaneResidualM) return std::nullopt;
  const std::optional<Eigen::Vector3d> point = Intersect(*plane, view.eye(), direction);
  if (!point) return std::nullopt;
  const double depth_m = view.Depth(*point), around = Median(depths);
  if (!(depth_m > around / 2 && depth_m < around * 2)) return std::nullopt;  // too much edge-on
  // A slanted plane carries its error along the ray.
  const double slant = std::max(std::abs(direction.dot(plane->normal)), 0.1);
  const double sigma_m = std::hypot(plane->residual_m, Median(sigmas)) / slant;
  return Landing{PointTarget{*point}, std::nullopt, *point, sigma_m, depth_m,
                 How::kPlane,         plane->normal};
}

/// With a target still to be set.
std::optional<Landing> GuessAt(const View& view, const Eigen::Vector2d& pixel,
                               const std::vector<Seen>& seen, double scale) {
  const std::optional<Eigen::Vector3d> direction = view.Ray(pixel);
  if (!direction) return std::nullopt;
  const auto at = [&](double depth_m, std::optional<double> sigma_m, How how) {
    const Eigen::Vector3d point = AtDepth(view, *direction, depth_m);
    return Landing{PointTarget{point}, std::nullopt, point, sigma_m, depth_m, how};
  };
  if (!seen.empty() && seen[0].away_px <= kFeaturePx * scale) {
    return at(seen[0].depth_m, Sigma(*seen[0].feature), How::kFeature);
  }
  if (auto landing = OnPlane(view, *direction, seen, kNearPx * scale)) return landing;
  if (seen.empty()) return at(kGuessedDepthM, std::nullopt, How::kUnknownDepth);
  std::vector<double> depths;
  for (std::size_t i = 0; i < std::min<std::size_t>(seen.size(), 12); ++i) {
    depths.push_back(seen[i].depth_m);
  }
  const double depth_m = Median(depths);
  return at(depth_m, 0.3 * depth_m, How::kNearbyDepth);
}

}  // namespace

std::optional<RayTarget> RayThrough(const View& view, const Eigen::Vector2d& pixel) {
  const std::optional<Eigen::Vector3d> direction = view.Ray(pixel);
  if (!direction) return std::nullopt;
  return RayTarget{view.eye(), *direction};
}

std::optional<Landing> LandingInVideo(const View& view, FrameId frame_id,
                                      const Eigen::Vector2d& pixel, const Features& features) {
  std::optional<Landing> landing = GuessAt(view, pixel, SeenFrom(view, pixel, features), 1);
  if (landing) landing->target = PixelTarget{frame_id, pixel};
  return landing;
}

std::optional<Landing> LandingInMap(const View& view, const Eigen::Vector2d& pixel,
                                    const Features& features, double pixels_per_point) {
  const std::vector<Seen> seen = SeenFrom(view, pixel, features);
  std::optional<Landing> landing = GuessAt(view, pixel, seen, pixels_per_point);
  const std::optional<RayTarget> ray = RayThrough(view, pixel);
  if (!landing || !ray || seen.empty()) return std::nullopt;
  const bool guessed = landing->how == How::kNearbyDepth || landing->how == How::kUnknownDepth;
  if (guessed && seen[0].away_px > kNearPx * pixels_per_point) return std::nullopt;
  if (seen[0].away_px <= kSnapPx * pixels_per_point) {
    landing->point_in_world = seen[0].feature->point_in_world;
    landing->target = FeatureTarget{seen[0].feature->id};
  } else {
    landing->target = *ray;
  }
  return landing;
}

std::optional<double> RingRadius(const View& view, const Landing& landing) {
  if (!landing.sigma_m) return std::nullopt;
  return *landing.sigma_m / landing.depth_m / view.camera->RadiansPerPixel();
}

std::string LandingWords(const View& view, const Landing& landing, bool metric) {
  if (!landing.sigma_m) return "depth unknown";
  const double sigma_m = *landing.sigma_m;
  std::string size = sigma_m < 0.0095 ? absl::StrFormat("%.0f mm", 1000 * sigma_m)
                                      : absl::StrFormat("%.0f cm", 100 * sigma_m);
  if (!metric) size = absl::StrFormat("%.0f px", RingRadius(view, landing).value_or(0));
  return absl::StrCat("±", size, landing.how == How::kNearbyDepth ? ", depth guessed" : "");
}

const Annotation* PickNearest(const View& view, const Eigen::Vector2d& pixel,
                              const std::vector<Annotation>& annotations, double radius_px) {
  const Annotation* best = nullptr;
  double best_px = radius_px;
  for (const Annotation& annotation : annotations) {
    if (!annotation.anchor.place_known) continue;
    const auto at = view.Project(annotation.anchor.point_in_world);
    if (!at || (*at - pixel).norm() > best_px) continue;
    best = &annotation;
    best_px = (*at - pixel).norm();
  }
  return best;
}

}  // namespace saccade::tools
