#include "server/anchors/local_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace saccade {
namespace {

constexpr double kRadiusRad = 0.35;       // what counts as near the ray
constexpr std::size_t kMaxSamples = 30;   // nearest ones
constexpr std::size_t kSeedSamples = 10;  // planes are proposed through triples of these
constexpr double kKernelRad = 0.06;       // weight falls to a half at this angle
constexpr double kMaxSlope = 5.0;         // |d ln(rho) / d angle|: a surface seen at 79 deg
constexpr double kPriorSlope = 2.0;       // sigma of the same, before any plane is known
constexpr double kAtFeaturePx = 3.0;
constexpr double kContradictPx = 6.0;
constexpr double kSparseRad = 0.015;  // ambiguity is not looked for on a finer scale
constexpr double kFloor = 0.004;      // share of depth: no estimate claims to be better

/// A plane seen from a pinhole: inverse depth is affine in x/z, y/z.
struct InverseDepthSample {
  Eigen::Vector2d angle;  // (x, y) / z
  double radius = 0;      // |angle|
  double rho = 0;         // 1 / z [1/m]
  double sigma = 0;       // of rho
  double kernel = 1;      // how much it says about the ray
  bool depth_known = false;
  std::size_t index = 0;
};

struct Plane {
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();  // rho = c0 + c1 x + c2 y
  double sigma_rho = 0;
  double score = 0;
  int inliers = 0;
};

double Predict(const Plane& plane, const Eigen::Vector2d& angle) {
  return plane.coefficients(0) + plane.coefficients.tail<2>().dot(angle);
}

std::vector<InverseDepthSample> Prepare(const std::vector<SurfaceSample>& samples) {
  std::vector<InverseDepthSample> out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d& point = samples[i].point_in_ray;
    const double sigma = samples[i].depth_sigma_m;
    if (!point.allFinite() || !(point.z() > 0) || !(sigma >= 0) || !(sigma < 0.5 * point.z())) {
      continue;
    }
    InverseDepthSample sample;
    sample.angle = point.head<2>() / point.z();
    sample.radius = sample.angle.norm();
    sample.rho = 1.0 / point.z();
    sample.sigma = sigma * sample.rho * sample.rho;
    sample.kernel = samples[i].trust / (1.0 + std::pow(sample.radius / kKernelRad, 2));
    sample.depth_known = samples[i].depth_known;
    sample.index = i;
    out.push_back(sample);
  }
  std::sort(out.begin(), out.end(),
            [](const auto& a, const auto& b) { return a.radius < b.radius; });
  return out;
}

class PlaneFinder {
 public:
  PlaneFinder(std::vector<InverseDepthSample> samples, bool metric, const AnchorOptions& options)
      : samples_(std::move(samples)), metric_(metric), options_(options) {}

  /// The plane that the samples near the ray agree on, or nothing.
  std::optional<Plane> Find() const {
    std::optional<Plane> best;
    const std::size_t n = std::min(samples_.size(), kSeedSamples);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        for (std::size_t k = j + 1; k < n; ++k) {
          std::optional<Plane> plane = Through(samples_[i], samples_[j], samples_[k]);
          if (!plane) continue;
          Score(*plane);
          if (!best || plane->score > best->score) best = plane;
        }
      }
    }
    if (!best || !Refine(*best) || !Refine(*best)) return std::nullopt;
    return best;
  }

  /// Residual tolerance in inverse depth: 2 cm or 1 % of depth.
  double Tolerance(double rho) const {
    const double relative = options_.plane_residual_relative;
    const double share = metric_ ? std::max(relative, options_.plane_residual_m * rho) : relative;
    return std::min(share, 0.05) * rho;
  }

  /// Squared residual over its own noise and the tolerance.
  double Chi2(const Plane& plane, const InverseDepthSample& sample) const {
    const double residual = sample.rho - Predict(plane, sample.angle);
    const double tolerance = Tolerance(sample.rho);
    return residual * residual / (sample.sigma * sample.sigma + tolerance * tolerance);
  }

  /// Variance of the depth at the ray because the ray may hit what the nearby outliers lie on and
  /// not the plane [m^2]: a mixture, weighted by nearness on the scale of the third nearest sample.
  double AmbiguityVariance(const Plane& plane) const {
    const double scale =
        std::max(kSparseRad, samples_[std::min<std::size_t>(2, samples_.size() - 1)].radius);
    double total = 0, spread = 0;
    for (const InverseDepthSample& sample : samples_) {
      const double weight = std::exp(-0.5 * std::pow(sample.radius / scale, 4));
      total += weight;
      if (Chi2(plane, sample) <= 9.0) continue;
      const double expected = Predict(plane, sample.angle);
      const double z = 1.0 / plane.coefficients(0);
      // The difference at the sample, carried to the ray as a share of depth.
      const double relative = std::clamp(expected / sample.rho - 1.0, -0.7, 2.0);
      spread += weight * std::pow(relative * z, 2);
    }
    return total > 0 ? spread / total : 0.0;
  }

 private:
  bool Plausible(const Plane& plane) const {
    const double rho = plane.coefficients(0);
    return plane.coefficients.allFinite() && rho > 0 &&
           plane.coefficients.tail<2>().norm() < kMaxSlope * rho;
  }

  /// Only triples round the ray: its barycentric coordinates say how far it is extrapolated.
  std::optional<Plane> Through(const InverseDepthSample& a, const InverseDepthSample& b,
                               const InverseDepthSample& c) const {
    Eigen::Matrix3d m;
    m << 1, a.angle.x(), a.angle.y(), 1, b.angle.x(), b.angle.y(), 1, c.angle.x(), c.angle.y();
    const double determinant = m.determinant();  // twice the area
    if (std::abs(determinant) < 1e-5) return std::nullopt;
    const Eigen::Matrix3d inverse = m.inverse();
    const Eigen::Vector3d barycentric = inverse.row(0).transpose();  // of the ray
    if (barycentric.cwiseAbs().maxCoeff() > 1.7) return std::nullopt;
    Plane plane;
    plane.coefficients = inverse * Eigen::Vector3d(a.rho, b.rho, c.rho);
    if (!Plausible(plane)) return std::nullopt;
    return plane;
  }

  void Score(Plane& plane) const {
    plane.score = 0;
    for (const InverseDepthSample& sample : samples_) {
      const double quality = sample.depth_known ? 1.0 : 0.3;
      plane.score += quality * sample.kernel * std::exp(-0.5 * Chi2(plane, sample));
    }
  }

  /// Weighted least squares over the inliers, with a weak prior on the slope. False if fewer than
  /// three triangulated features agree or they leave the ray's depth open.
  bool Refine(Plane& plane) const {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const double slope_sigma = kPriorSlope * plane.coefficients(0);
    normal(1, 1) = normal(2, 2) = 1.0 / (slope_sigma * slope_sigma);
    int triangulated = 0;
    double residual2 = 0, weight_sum = 0;
    for (const InverseDepthSample& sample : samples_) {
      if (Chi2(plane, sample) > 9.0) continue;
      const double tolerance = 0.5 * Tolerance(sample.rho);
      const double weight = sample.kernel / (sample.sigma * sample.sigma + tolerance * tolerance);
      const Eigen::Vector3d row(1.0, sample.angle.x(), sample.angle.y());
      normal += weight * row * row.transpose();
      right += weight * sample.rho * row;
      triangulated += sample.depth_known ? 1 : 0;
      residual2 += sample.kernel * std::pow(sample.rho - Predict(plane, sample.angle), 2);
      weight_sum += sample.kernel;
    }
    if (triangulated < 3) return false;
    const Eigen::Matrix3d covariance = normal.inverse();
    plane.coefficients = covariance * right;
    plane.inliers = triangulated;
    if (!Plausible(plane)) return false;
    // Weights below 1 for far samples make this larger than the pure noise figure: intended.
    plane.sigma_rho = std::sqrt(covariance(0, 0));
    const double rho = plane.coefficients(0);
    const double rms = std::sqrt(residual2 / weight_sum);
    const double noise = std::sqrt(covariance(0, 0) * weight_sum);  // no tolerance wider than it
    return rms < std::max(Tolerance(rho), noise) * 2.0 && plane.sigma_rho < 0.08 * rho;
  }

  std::vector<InverseDepthSample> samples_;
  bool metric_;
  const AnchorOptions& options_;
};

SurfaceDepth FromPlane(const Plane& plane) {
  SurfaceDepth depth;
  const double rho = plane.coefficients(0);
  depth.method = AnchorMethod::kPlane;
  depth.depth_m = 1.0 / rho;
  depth.sigma_m = std::hypot(plane.sigma_rho / (rho * rho), kFloor / rho);
  // rho = n . (x/z, y/z, 1) for the plane n . X = 1, so n = (c1, c2, c0).
  depth.normal_in_ray =
      -Eigen::Vector3d(plane.coefficients(1), plane.coefficients(2), rho).normalized();
  return depth;
}

SurfaceDepth FromFeature(const InverseDepthSample& sample, double radians_per_px) {
  SurfaceDepth depth;
  const double z = 1.0 / sample.rho;
  const double slope = 0.7 * sample.radius * z;  // a surface of unknown slope between the two
  depth.method = AnchorMethod::kFeature;
  depth.depth_m = z;
  depth.sigma_m = std::hypot(sample.sigma * z * z, slope, kFloor * z);
  if (sample.radius < kAtFeaturePx * radians_per_px) depth.at_feature = sample.index;
  return depth;
}

SurfaceDepth FromMedian(std::vector<InverseDepthSample> samples, double relative_sigma) {
  std::sort(samples.begin(), samples.end(),
            [](const auto& a, const auto& b) { return a.rho < b.rho; });
  const auto weight = [](const InverseDepthSample& sample) {
    const double relative = sample.sigma / sample.rho;
    return sample.kernel / (relative * relative + 0.01);
  };
  double total = 0;
  for (const InverseDepthSample& sample : samples) total += weight(sample);
  double below = 0;
  SurfaceDepth depth;
  for (const InverseDepthSample& sample : samples) {
    below += weight(sample);
    if (below < 0.5 * total) continue;
    depth.depth_m = 1.0 / sample.rho;
    depth.sigma_m = relative_sigma * depth.depth_m;
    break;
  }
  return depth;
}

}  // namespace

std::optional<SurfaceDepth> EstimateDepth(const std::vector<SurfaceSample>& samples,
                                          double radians_per_px, bool metric,
                                          const AnchorOptions& options) {
  const std::vector<InverseDepthSample> all = Prepare(samples);
  if (all.empty()) return std::nullopt;
  std::vector<InverseDepthSample> near;
  for (const InverseDepthSample& sample : all) {
    if (sample.radius < kRadiusRad && near.size() < kMaxSamples) near.push_back(sample);
  }
  // Of a surface that nobody has seen a point of, the rest of the room says next to nothing.
  if (near.empty()) return FromMedian(all, options.far_depth_sigma);

  const auto nearest =
      std::find_if(near.begin(), near.end(), [](const auto& sample) { return sample.depth_known; });
  const bool has_nearest = nearest != near.end();
  const double nearest_px = has_nearest ? nearest->radius / radians_per_px : 1e9;
  const PlaneFinder finder(near, metric, options);
  if (const std::optional<Plane> plane = finder.Find()) {
    const bool contradicted = nearest_px < kContradictPx && finder.Chi2(*plane, *nearest) > 16.0;
    SurfaceDepth depth = contradicted ? FromFeature(*nearest, radians_per_px) : FromPlane(*plane);
    if (contradicted) {
      // Either may be right: say so, and let the seeded feature decide.
      depth.sigma_m =
          std::hypot(depth.sigma_m, 0.3 * std::abs(depth.depth_m - 1.0 / plane->coefficients(0)));
    } else {
      depth.sigma_m = std::hypot(depth.sigma_m, std::sqrt(finder.AmbiguityVariance(*plane)));
      const auto on_plane = [&](const InverseDepthSample& sample) {
        return sample.depth_known && finder.Chi2(*plane, sample) <= 9.0;
      };
      const auto first = std::find_if(near.begin(), near.end(), on_plane);  // nearest first
      depth.nearest_rad = first == near.end() ? kRadiusRad : first->radius;
      if (nearest_px < kAtFeaturePx) depth.at_feature = nearest->index;
    }
    return depth;
  }
  if (nearest_px < options.feature_radius_px) return FromFeature(*nearest, radians_per_px);
  return FromMedian(near, options.median_depth_sigma);
}

}  // namespace saccade
