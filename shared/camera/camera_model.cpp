#include "shared/camera/camera_model.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace saccade {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kMaxTangent = 1e4;            // 0.006 deg short of 90 deg from the optic axis
constexpr double kNewtonTolerance_px = 1e-10;  // asked for
constexpr double kAccepted_px = 1e-7;          // taken, if rounding allows no better (T10: 1e-6)

/// First r in (0, limit] where the even polynomial 1 + c[0] r^2 + c[1] r^4 + ... stops being
/// positive, or `limit`.
template <std::size_t N>
double FirstNonPositive(const std::array<double, N>& c, double limit) {
  const auto value = [&c](double r) {
    double sum = 0.0;
    for (std::size_t i = N; i-- > 0;) sum = (sum + c[i]) * r * r;
    return 1.0 + sum;
  };
  double low = 0.0;
  // Geometric steps: lenses turn over between about 0.5 and 3, so the grid is finest there.
  for (double high = 1e-2; low < limit; high *= 1.01) {
    high = std::min(high, limit);
    if (value(high) <= 0.0) {
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (value(middle) > 0.0 ? low : high) = middle;
      }
      return low;
    }
    low = high;
  }
  return limit;
}

double InvertibleRadius(const CameraIntrinsics& c) {
  const auto& k = c.distortion;
  switch (c.model) {
    case LensModel::kPinhole:
      return kMaxTangent;
    case LensModel::kRadial1:
      // k1 < 0: the root of 1 + 2 k1 |u|^2, less a part in 1e6 where the picture is infinitely far.
      return k[0] < 0 ? (1.0 - 1e-6) / std::sqrt(-2.0 * k[0]) : kMaxTangent * std::max(c.fx, c.fy);
    case LensModel::kBrownConrady:
      return FirstNonPositive<3>({3 * k[0], 5 * k[1], 7 * k[4]}, kMaxTangent);
    case LensModel::kKannalaBrandt:
      return FirstNonPositive<4>({3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]},
                                 0.5 * std::numbers::pi - 1e-4);
    case LensModel::kFov:
      return kMaxTangent;
  }
  return 0.0;
}

/// Brown-Conrady on normalised coordinates; `jacobian` may be null.
Vector2d DistortBrownConrady(const std::array<double, 5>& k, const Vector2d& p,
                             Matrix2d* jacobian) {
  const double x = p.x(), y = p.y(), xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double p1 = k[2], p2 = k[3];
  if (jacobian != nullptr) {
    const double slope =
        2.0 * (k[0] + r2 * (2.0 * k[1] + r2 * 3.0 * k[4]));  // d radial/dx = slope x
    const double cross = xy * slope + 2.0 * (p1 * x + p2 * y);
    *jacobian << radial + xx * slope + 2.0 * p1 * y + 6.0 * p2 * x, cross,  //
        cross, radial + yy * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  }
  return {x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx),
          y * radial + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy};
}

/// Distorted angle of the Kannala-Brandt model and its derivative.
double DistortAngle(const std::array<double, 5>& k, double theta, double* derivative) {
  const double t = theta * theta;
  *derivative = 1.0 + t * (3 * k[0] + t * (5 * k[1] + t * (7 * k[2] + t * 9 * k[3])));
  return theta * (1.0 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
}

std::optional<Vector2d> ProjectKannalaBrandt(const CameraIntrinsics& c, double max_theta,
                                             const Vector3d& p, Matrix23d* jacobian) {
  const double r2 = p.x() * p.x() + p.y() * p.y(), r = std::sqrt(r2);
  const double theta = std::atan2(r, p.z());
  if (!(p.z() > 0.0) || !(theta <= max_theta)) return std::nullopt;
  double slope = 1.0;
  const double distorted = DistortAngle(c.distortion, theta, &slope);
  const bool on_axis = r < 1e-4 * p.z();
  const double scale =
      on_axis ? (1.0 + (c.distortion[0] - 1.0 / 3.0) * theta * theta) / p.z() : distorted / r;
  if (jacobian != nullptr) {
    const double norm2 = r2 + p.z() * p.z();
    // d scale/dX = X bend, d scale/dY = Y bend; on the axis by its series.
    const double bend = on_axis ? 2.0 * (c.distortion[0] - 1.0 / 3.0) / (p.z() * p.z() * p.z())
                                : (slope * p.z() / norm2 - scale) / r2;
    const double along = -slope / norm2;
    *jacobian << c.fx * (scale + p.x() * p.x() * bend), c.fx * p.x() * p.y() * bend,
        c.fx * p.x() * along, c.fy * p.x() * p.y() * bend, c.fy * (scale + p.y() * p.y() * bend),
        c.fy * p.y() * along;
  }
  return Vector2d(c.fx * scale * p.x() + c.cx, c.fy * scale * p.y() + c.cy);
}

/// Newton's method on the distortion, started at `start`; the undistorted point or nothing.
std::optional<Vector2d> SolveBrownConrady(const CameraIntrinsics& c, double max_radius,
                                          const Vector2d& distorted, const Vector2d& start) {
  Vector2d p = start;
  double error_px = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20; ++i) {
    Matrix2d jacobian;
    const Vector2d residual = DistortBrownConrady(c.distortion, p, &jacobian) - distorted;
    error_px = std::max(std::abs(residual.x()) * c.fx, std::abs(residual.y()) * c.fy);
    if (error_px < kNewtonTolerance_px) break;
    const double determinant = jacobian.determinant();
    if (!(determinant > 1e-9)) return std::nullopt;
    p -= jacobian.inverse() * residual;
    const double radius = p.norm();
    if (!(radius <= max_radius)) p *= max_radius / radius;  // back inside; NaN ends below
  }
  if (!(error_px < kAccepted_px)) return std::nullopt;
  return p;
}

/// The radius whose distorted length is `target`, by bisection; tangential terms left out.
double InvertRadially(const std::array<double, 5>& k, double max_radius, double target) {
  double low = 0.0, high = max_radius;
  for (int i = 0; i < 60; ++i) {
    const double r = 0.5 * (low + high), r2 = r * r;
    (r * (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) < target ? low : high) = r;
  }
  return low;
}

std::optional<Vector3d> UnprojectKannalaBrandt(const CameraIntrinsics& c, double max_theta,
                                               const Vector2d& distorted) {
  const double target = distorted.norm();
  if (!(target > 0.0)) return std::isnan(target) ? std::nullopt : std::optional(Vector3d(0, 0, 1));
  double slope = 1.0;
  if (target > DistortAngle(c.distortion, max_theta, &slope)) return std::nullopt;
  double low = 0.0, high = max_theta, theta = std::min(target, max_theta);
  for (int i = 0; i < 60; ++i) {
    const double error = DistortAngle(c.distortion, theta, &slope) - target;
    if (std::abs(error) * c.fx < kNewtonTolerance_px) break;
    (error > 0.0 ? high : low) = theta;
    theta -= error / slope;
    if (!(theta > low && theta < high)) theta = 0.5 * (low + high);
  }
  const double sine = std::sin(theta) / target;
  return Vector3d(distorted.x() * sine, distorted.y() * sine, std::cos(theta));
}

/// s = 2 tan(w / 2) of the FOV lens.
double FovStretch(const CameraIntrinsics& c) { return 2.0 * std::tan(0.5 * c.distortion[0]); }

/// r_d = atan(s r) / w (Devernay and Faugeras, 2001), r = tan of the angle to the optic axis.
std::optional<Vector2d> ProjectFov(const CameraIntrinsics& c, double max_tangent, const Vector3d& p,
                                   Matrix23d* jacobian) {
  const double r2 = p.x() * p.x() + p.y() * p.y(), r = std::sqrt(r2);
  if (!(p.z() > 0.0) || !(r <= max_tangent * p.z())) return std::nullopt;
  const double w = c.distortion[0], s = FovStretch(c), z = p.z();
  const bool on_axis = r < 1e-4 * z;
  const double square = s * s * r2 / (z * z);  // on the axis by its series
  const double scale =
      on_axis ? s / (w * z) * (1.0 - square / 3.0) : std::atan2(s * r, z) / (w * r);
  if (jacobian != nullptr) {
    const double norm2 = z * z + s * s * r2;
    const double bend =  // d scale/dX = X bend, d scale/dY = Y bend
        on_axis ? -2.0 * s * s * s / (3.0 * w * z * z * z) : (s * z / (w * norm2) - scale) / r2;
    const double along = -s / (w * norm2);
    *jacobian << c.fx * (scale + p.x() * p.x() * bend), c.fx * p.x() * p.y() * bend,
        c.fx * p.x() * along, c.fy * p.x() * p.y() * bend, c.fy * (scale + p.y() * p.y() * bend),
        c.fy * p.y() * along;
  }
  return Vector2d(c.fx * scale * p.x() + c.cx, c.fy * scale * p.y() + c.cy);
}

std::optional<Vector3d> UnprojectFov(const CameraIntrinsics& c, double max_tangent,
                                     const Vector2d& distorted) {
  const double w = c.distortion[0], s = FovStretch(c), length = distorted.norm();
  const double angle = length * w;
  if (!(angle <= std::atan(s * max_tangent))) return std::nullopt;
  const double sine = length > 1e-12 ? std::sin(angle) / (s * length) : w / s;
  return Vector3d(distorted.x() * sine, distorted.y() * sine, std::cos(angle)).normalized();
}

}  // namespace

CameraModel::CameraModel(const CameraIntrinsics& intrinsics)
    : intrinsics_(intrinsics), max_radius_(InvertibleRadius(intrinsics)) {}

std::optional<Vector2d> CameraModel::Project(const Vector3d& point_in_camera,
                                             Matrix23d* d_pixel_d_point) const {
  const CameraIntrinsics& c = intrinsics_;
  if (c.model == LensModel::kKannalaBrandt) {
    return ProjectKannalaBrandt(c, max_radius_, point_in_camera, d_pixel_d_point);
  }
  if (c.model == LensModel::kFov)
    return ProjectFov(c, max_radius_, point_in_camera, d_pixel_d_point);
  if (!(point_in_camera.z() > 0.0)) return std::nullopt;
  const double inverse_z = 1.0 / point_in_camera.z();
  const Vector2d p = point_in_camera.head<2>() * inverse_z;
  Vector2d pixel;
  Matrix2d d_pixel_d_p;  // p: normalised coordinates
  if (c.model == LensModel::kRadial1) {
    const Vector2d u(c.fx * p.x(), c.fy * p.y());
    const double u2 = u.squaredNorm();
    if (!(u2 <= max_radius_ * max_radius_)) return std::nullopt;
    const double scale = 1.0 / std::sqrt(1.0 + 2.0 * c.distortion[0] * u2);
    pixel = scale * u;
    if (d_pixel_d_point != nullptr) {
      const double bend = -2.0 * c.distortion[0] * scale * scale * scale;
      d_pixel_d_p << c.fx * (scale + bend * u.x() * u.x()), c.fy * bend * u.x() * u.y(),
          c.fx * bend * u.x() * u.y(), c.fy * (scale + bend * u.y() * u.y());
    }
  } else {
    if (!(p.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
    d_pixel_d_p.setIdentity();
    const Vector2d distorted =
        c.model == LensModel::kPinhole
            ? p
            : DistortBrownConrady(c.distortion, p, d_pixel_d_point ? &d_pixel_d_p : nullptr);
    pixel = Vector2d(c.fx * distorted.x(), c.fy * distorted.y());
    d_pixel_d_p.row(0) *= c.fx;
    d_pixel_d_p.row(1) *= c.fy;
  }
  if (d_pixel_d_point != nullptr) {
    d_pixel_d_point->leftCols<2>() = inverse_z * d_pixel_d_p;
    d_pixel_d_point->col(2) = -inverse_z * (d_pixel_d_p * p);
  }
  return Vector2d(pixel.x() + c.cx, pixel.y() + c.cy);
}

std::optional<Vector3d> CameraModel::Unproject(
    const Vector2d& pixel, Eigen::Matrix<double, 3, 2>* d_bearing_d_pixel) const {
  const CameraIntrinsics& c = intrinsics_;
  const Vector2d distorted((pixel.x() - c.cx) / c.fx, (pixel.y() - c.cy) / c.fy);
  if (!std::isfinite(distorted.x()) || !std::isfinite(distorted.y())) return std::nullopt;
  Vector2d p = distorted;
  std::optional<Vector3d> bearing;
  if (c.model == LensModel::kKannalaBrandt) {
    bearing = UnprojectKannalaBrandt(c, max_radius_, distorted);
    if (!bearing) return std::nullopt;
  } else if (c.model == LensModel::kFov) {
    bearing = UnprojectFov(c, max_radius_, distorted);
    if (!bearing) return std::nullopt;
  } else if (c.model == LensModel::kRadial1) {
    const double ud2 = (pixel - Vector2d(c.cx, c.cy)).squaredNorm();
    const double inside = 1.0 - 2.0 * c.distortion[0] * ud2;
    if (!(inside > 1e-9)) return std::nullopt;
    p /= std::sqrt(inside);
    const double u2 = ud2 / inside;
    if (!(u2 <= max_radius_ * max_radius_)) return std::nullopt;
  } else if (c.model == LensModel::kBrownConrady) {
    auto solved = SolveBrownConrady(c, max_radius_, distorted, distorted);
    if (!solved) {  // strong distortion: start from the radial solution
      const double length = distorted.norm();
      const double radius = InvertRadially(c.distortion, max_radius_, length);
      solved = SolveBrownConrady(c, max_radius_, distorted, distorted * (radius / length));
    }
    if (!solved) return std::nullopt;
    p = *solved;
  }
  if (!bearing) bearing = Vector3d(p.x(), p.y(), 1.0).normalized();
  if (d_bearing_d_pixel != nullptr) {
    // The projection ignores length, so the rows of its Jacobian J at the unit bearing span the
    // tangent plane there, and the pseudo-inverse J^T (J J^T)^-1 is the derivative asked for.
    Matrix23d jacobian;
    if (!Project(*bearing, &jacobian)) return std::nullopt;
    *d_bearing_d_pixel = jacobian.transpose() * Matrix2d(jacobian * jacobian.transpose()).inverse();
  }
  return bearing;
}

}  // namespace saccade
