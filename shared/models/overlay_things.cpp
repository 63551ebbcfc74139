#include "shared/models/overlay_things.hpp"

#include <cmath>

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr int kSides = 12;
constexpr double kLift_m = 0.004;  // of what lies on a floor, above it
constexpr double kLine_m = 0.012;
constexpr double kHeadEvery_m = 0.42;

void AddTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, std::uint32_t color,
                 TriangleMesh& mesh) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vector3d& p : {a, b, c}) mesh.positions.push_back(p.cast<float>());
  mesh.triangles.push_back({base, base + 1, base + 2});
  mesh.colors_rgba.push_back(color);
}

void AddQuad(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d,
             std::uint32_t color, TriangleMesh& mesh) {
  AddTriangle(a, b, c, color, mesh);
  AddTriangle(a, c, d, color, mesh);
}

/// Round `axis` at `middle`.
std::vector<Vector3d> Ring(const Vector3d& middle, const Vector3d& axis, double radius_m) {
  const Vector3d other =
      std::abs(axis.y()) < 0.9 * axis.norm() ? Vector3d::UnitY() : Vector3d::UnitX();
  const Vector3d u = axis.cross(other).normalized(), v = axis.cross(u).normalized();
  std::vector<Vector3d> ring;
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2.0 * M_PI * k / kSides;
    ring.push_back(middle + radius_m * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return ring;
}

/// A frustum along from-to, closed at both ends.
void AddFrustum(const Vector3d& from, const Vector3d& to, double radius_from, double radius_to,
                std::uint32_t color, TriangleMesh& mesh) {
  const auto first = Ring(from, to - from, radius_from), last = Ring(to, to - from, radius_to);
  for (int k = 0; k < kSides; ++k) {
    const int next = (k + 1) % kSides;
    AddQuad(first[k], first[next], last[next], last[k], color, mesh);
    AddTriangle(from, first[next], first[k], color, mesh);
    AddTriangle(to, last[k], last[next], color, mesh);
  }
}

/// A flat arrow head that points along `forward`, on the floor.
void AddHead(const Vector3d& tip, const Vector3d& forward, double width_m, std::uint32_t color,
             TriangleMesh& mesh) {
  const Vector3d side = 0.5 * width_m * forward.cross(Vector3d::UnitY());
  const Vector3d back = -0.55 * width_m * forward, thick = -0.4 * width_m * forward;
  const Vector3d left = tip + back + side, right = tip + back - side;
  AddQuad(tip, left, left + thick, tip + thick, color, mesh);
  AddQuad(tip, tip + thick, right + thick, right, color, mesh);
}

}  // namespace

TriangleMesh TubeMesh(std::span<const Vector3d> way, double radius_m, std::uint32_t color_rgba) {
  TriangleMesh mesh;
  for (std::size_t k = 0; k + 1 < way.size(); ++k) {
    AddFrustum(way[k], way[k + 1], radius_m, radius_m, color_rgba, mesh);
    if (k == 0) continue;
    // A ball at the bend, of two blunt cones.
    const Vector3d axis = (way[k + 1] - way[k]).normalized() * radius_m;
    AddFrustum(way[k] - axis, way[k], 0.5 * radius_m, 1.15 * radius_m, color_rgba, mesh);
    AddFrustum(way[k], way[k] + axis, 1.15 * radius_m, 0.5 * radius_m, color_rgba, mesh);
  }
  return mesh;
}

TriangleMesh FloorGridMesh(double size_x_m, double size_z_m, double step_m,
                           std::uint32_t color_rgba) {
  TriangleMesh mesh;
  const auto line = [&](const Vector3d& from, const Vector3d& to, const Vector3d& side) {
    AddQuad(from - side, to - side, to + side, from + side, color_rgba, mesh);
  };
  const double x = 0.5 * size_x_m, z = 0.5 * size_z_m, h = 0.5 * kLine_m;
  for (int k = 0; k <= static_cast<int>(std::floor(size_x_m / step_m + 1e-6)); ++k) {
    const double at = -x + step_m * k;
    line({at, -kLift_m, -z}, {at, -kLift_m, z}, {h, 0, 0});
  }
  for (int k = 0; k <= static_cast<int>(std::floor(size_z_m / step_m + 1e-6)); ++k) {
    const double at = -z + step_m * k;
    line({-x, -kLift_m, at}, {x, -kLift_m, at}, {0, 0, h});
  }
  return mesh;
}

TriangleMesh RouteMesh(std::span<const Vector3d> way, double width_m, std::uint32_t color_rgba) {
  TriangleMesh mesh;
  const Vector3d lift(0, -kLift_m, 0);
  double until_next = 0.5 * kHeadEvery_m;
  for (std::size_t k = 0; k + 1 < way.size(); ++k) {
    const Vector3d line = way[k + 1] - way[k];
    const Vector3d forward = line.normalized();
    double at = until_next;
    for (; at < line.norm(); at += kHeadEvery_m) {
      AddHead(way[k] + at * forward + lift, forward, width_m, color_rgba, mesh);
    }
    until_next = at - line.norm();
    if (k + 2 == way.size()) {
      AddHead(way[k + 1] + 0.3 * width_m * forward + lift, forward, 1.7 * width_m, color_rgba,
              mesh);
    }
  }
  return mesh;
}

TriangleMesh ArrowMesh(const Vector3d& from, const Vector3d& to, double radius_m,
                       std::uint32_t color_rgba) {
  TriangleMesh mesh;
  const Vector3d neck = to - 5.0 * radius_m * (to - from).normalized();
  AddFrustum(from, neck, radius_m, radius_m, color_rgba, mesh);
  AddFrustum(neck, to, 2.6 * radius_m, 0.02 * radius_m, color_rgba, mesh);
  return mesh;
}

TriangleMesh PictureMesh(std::span<const std::uint32_t> pixels_rgba, int columns, double width_m) {
  TriangleMesh mesh;
  if (columns <= 0) return mesh;
  const int rows = static_cast<int>(pixels_rgba.size()) / columns;
  const double step = width_m / columns;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double x = step * i - 0.5 * width_m, y = step * (j - rows);
      AddQuad({x, y, 0}, {x, y + step, 0}, {x + step, y + step, 0}, {x + step, y, 0},
              pixels_rgba[static_cast<std::size_t>(j) * columns + i], mesh);
    }
  }
  return mesh;
}

}  // namespace saccade
