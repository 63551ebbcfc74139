#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "shared/marks/strokes.hpp"

namespace saccade {
namespace {

constexpr double kNearest_m = 0.02;
constexpr double kMaxBendPx = 0.25;
constexpr double kLineBorder_px = 32.0;
constexpr int kMaxDepth = 8;

using MaybePixel = std::optional<Eigen::Vector2d>;

class Projector {
 public:
  explicit Projector(const CameraModel& camera) : camera_(camera) {}

  MaybePixel Project(const Eigen::Vector3d& point_in_camera) const {
    const MaybePixel pixel = camera_.Project(point_in_camera);
    return pixel && pixel->allFinite() ? pixel : std::nullopt;
  }
  bool Near(const Eigen::Vector2d& pixel) const { return camera_.InImage(pixel, -kLineBorder_px); }

  /// Pixels along a segment, close enough together that straight lines between them will do.
  std::vector<MaybePixel> Sample(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    std::vector<MaybePixel> out = {Project(a)};
    Divide(a, b, 0, out);
    return out;
  }

 private:
  void Divide(const Eigen::Vector3d& p, const Eigen::Vector3d& q, int depth,
              std::vector<MaybePixel>& out) const {
    const MaybePixel start = Project(p);
    const MaybePixel end = Project(q);
    if (depth < kMaxDepth && NeedsDivision(p, q, start, end)) {
      const Eigen::Vector3d middle = 0.5 * (p + q);
      Divide(p, middle, depth + 1, out);
      Divide(middle, q, depth + 1, out);
    } else {
      out.push_back(end);
    }
  }

  bool NeedsDivision(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const MaybePixel& start,
                     const MaybePixel& end) const {
    if (!start || !end) return start.has_value() != end.has_value();
    const bool inside = Near(*start);
    if (inside != Near(*end)) return true;
    // Quarters as well: a bend with its turning point in the middle would hide there.
    for (const double t : {0.25, 0.5, 0.75}) {
      const MaybePixel on = Project(p + t * (q - p));
      if (!on || DistanceFromLine(*on, *start, *end) > kMaxBendPx) return true;
      if (!inside && Near(*on)) return true;
    }
    return false;
  }

  static double DistanceFromLine(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                                 const Eigen::Vector2d& b) {
    const Eigen::Vector2d along = b - a;
    const Eigen::Vector2d to = p - a;
    const double length = along.norm();
    if (length < 1e-9) return to.norm();
    return std::abs(along.x() * to.y() - along.y() * to.x()) / length;
  }

  const CameraModel& camera_;
};

/// What of the segment lies in front of the near plane, and which ends were cut off.
struct Piece {
  Eigen::Vector3d a, b;
  bool a_cut = false, b_cut = false;
};

std::optional<Piece> CutAtNear(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (!a.allFinite() || !b.allFinite() || (a.z() < kNearest_m && b.z() < kNearest_m))
    return std::nullopt;
  Piece piece{a, b};
  if (a.z() >= kNearest_m && b.z() >= kNearest_m) return piece;
  const Eigen::Vector3d cut = a + (kNearest_m - a.z()) / (b.z() - a.z()) * (b - a);
  if (!cut.allFinite()) return std::nullopt;
  (a.z() < kNearest_m ? piece.a : piece.b) = cut;
  (a.z() < kNearest_m ? piece.a_cut : piece.b_cut) = true;
  return piece;
}

}  // namespace

std::vector<Polyline2> ProjectPolyline(const CameraModel& camera, const Rigid3& camera_from_world,
                                       const Polyline3& points_in_world) {
  const Projector projector(camera);
  // Once each: the end of a segment and the beginning of the next are then the same to the bit.
  Polyline3 points;
  points.reserve(points_in_world.size());
  for (const Eigen::Vector3d& point : points_in_world) points.push_back(camera_from_world * point);
  std::vector<Polyline2> out;
  Polyline2 current;
  const auto close = [&out, &current] {
    if (current.size() > 1) out.push_back(std::move(current));
    current.clear();
  };
  for (std::size_t i = 1; i < points.size(); ++i) {
    const std::optional<Piece> piece = CutAtNear(points[i - 1], points[i]);
    if (!piece) {
      close();
      continue;
    }
    if (piece->a_cut) close();
    for (const MaybePixel& pixel : projector.Sample(piece->a, piece->b)) {
      if (!pixel || !projector.Near(*pixel)) {
        close();
      } else if (current.empty() || current.back() != *pixel) {
        current.push_back(*pixel);
      }
    }
    if (piece->b_cut) close();
  }
  close();
  return out;
}

}  // namespace saccade
