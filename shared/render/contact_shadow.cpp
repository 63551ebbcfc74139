#include "shared/render/contact_shadow.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFoot_m = 0.03;    // what is no higher is the foot
constexpr double kAbove_m = 0.002;  // over what it falls on; below kOcclusionBias_m
constexpr double kReach_m = 0.02;   // a support is no farther below
constexpr double kLeastSoft_m = 0.03, kMostSoft_m = 0.12, kSoftShare = 0.2;
constexpr double kDarkest = 0.5;
constexpr int kRings = 5, kRound = 8;  // of the soft rim; points round each corner
constexpr std::size_t kMostThings = 64;

using Triangle = std::array<Vector3d, 3>;

std::vector<Triangle> TrianglesOf(const PlacedMesh& placed) {
  std::vector<Triangle> all;
  for (const auto& one : placed.mesh->triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = placed.world_from_mesh * placed.mesh->positions[one[k]].cast<double>();
    }
    all.push_back(triangle);
  }
  return all;
}

/// Height (y) of a triangle over a point of the floor plan; nothing where it is not.
bool HeightAt(const Triangle& t, const Vector2d& at, double& y) {
  const Vector2d a(t[0].x(), t[0].z()), b(t[1].x(), t[1].z()), c(t[2].x(), t[2].z());
  Eigen::Matrix2d sides;
  sides << b - a, c - a;
  const double area = sides.determinant();
  if (std::abs(area) < 1e-12) return false;
  const Vector2d uv = sides.inverse() * (at - a);
  constexpr double kEdge = 1e-6;
  if (uv.minCoeff() < -kEdge || uv.sum() > 1.0 + kEdge) return false;
  y = t[0].y() + uv.x() * (t[1].y() - t[0].y()) + uv.y() * (t[2].y() - t[0].y());
  return true;
}

/// Convex outline in the floor plan, in order (Andrew's monotone chain).
std::vector<Vector2d> Outline(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  const auto left = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 1e-12;
  };
  std::vector<Vector2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t first = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= first + 2 && !left(hull[hull.size() - 2], hull.back(), p)) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// Points `away` outside the outline, rounded at its corners; as many for every distance.
std::vector<Vector2d> Around(const std::vector<Vector2d>& outline, double away) {
  std::vector<Vector2d> points;
  const std::size_t n = outline.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Vector2d before = outline[k] - outline[(k + n - 1) % n];
    const Vector2d after = outline[(k + 1) % n] - outline[k];
    // Counter-clockwise outlines have their outside at the right.
    const double from = std::atan2(-before.x(), before.y());
    double turn = std::atan2(-after.x(), after.y()) - from;
    while (turn < 0.0) turn += 2.0 * M_PI;
    for (int i = 0; i <= kRound; ++i) {
      const double angle = from + turn * i / kRound;
      points.push_back(outline[k] + away * Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  return points;
}

class Supports {
 public:
  Supports(std::span<const PlacedMesh> meshes, std::size_t thing, double foot_y) : foot_y_(foot_y) {
    for (std::size_t k = 0; k < meshes.size(); ++k) {
      const bool solid = meshes[k].material == SceneMaterial::kReal ||
                         meshes[k].material == SceneMaterial::kVirtual;
      if (k == thing || !solid) continue;
      for (const Triangle& t : TrianglesOf(meshes[k])) {
        const auto [low, high] = std::minmax({t[0].y(), t[1].y(), t[2].y()});
        if (high >= foot_y - kReach_m && low <= foot_y + kReach_m) near_.push_back(t);
      }
    }
  }
  bool Under(const Vector2d& at) const {
    return std::any_of(near_.begin(), near_.end(), [&](const Triangle& t) {
      double y = 0.0;
      return HeightAt(t, at, y) && std::abs(y - foot_y_) <= kReach_m;
    });
  }

 private:
  double foot_y_;
  std::vector<Triangle> near_;
};

void AddShadow(std::span<const PlacedMesh> meshes, std::size_t thing, ShadowMesh& shadows) {
  const PlacedMesh& placed = meshes[thing];
  double foot_y = -1e9;
  std::vector<Vector3d> points;
  for (const Eigen::Vector3f& p : placed.mesh->positions) {
    points.push_back(placed.world_from_mesh * p.cast<double>());
    foot_y = std::max(foot_y, points.back().y());
  }
  std::vector<Vector2d> foot;
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Vector3d& p : points) {
    if (p.y() < foot_y - kFoot_m) continue;
    foot.emplace_back(p.x(), p.z());
    low = low.cwiseMin(foot.back());
    high = high.cwiseMax(foot.back());
  }
  const std::vector<Vector2d> outline = Outline(std::move(foot));
  if (outline.size() < 3) return;
  const Supports supports(meshes, thing, foot_y);
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& p : outline) middle += p / static_cast<double>(outline.size());
  const double soft_m = std::clamp(kSoftShare * (high - low).minCoeff(), kLeastSoft_m, kMostSoft_m);
  const auto add = [&](const Vector2d& at, double darkness) {
    shadows.positions.emplace_back(Vector3d(at.x(), foot_y - kAbove_m, at.y()).cast<float>());
    shadows.darkness.push_back(static_cast<float>(supports.Under(at) ? darkness : 0.0));
    return static_cast<std::uint32_t>(shadows.positions.size() - 1);
  };
  const std::uint32_t centre = add(middle, kDarkest);
  std::uint32_t last = 0, count = 0;
  for (int ring = 0; ring <= kRings; ++ring) {
    const double share = static_cast<double>(ring) / kRings;
    const std::vector<Vector2d> round = Around(outline, share * soft_m);
    count = static_cast<std::uint32_t>(round.size());
    std::uint32_t first = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t index = add(round[k], kDarkest * (1.0 - share) * (1.0 - share));
      if (k == 0) first = index;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t next = (k + 1) % count;
      if (ring == 0) {
        shadows.triangles.push_back({centre, first + k, first + next});
      } else {
        shadows.triangles.push_back({last + k, first + k, first + next});
        shadows.triangles.push_back({last + k, first + next, last + next});
      }
    }
    last = first;
  }
}

}  // namespace

ShadowMesh ContactShadows(std::span<const PlacedMesh> meshes) {
  ShadowMesh shadows;
  std::size_t things = 0;
  for (std::size_t k = 0; k < meshes.size() && things < kMostThings; ++k) {
    if (meshes[k].material != SceneMaterial::kVirtual || meshes[k].mesh->positions.empty()) {
      continue;
    }
    ++things;
    AddShadow(meshes, k, shadows);
  }
  return shadows;
}

}  // namespace saccade
