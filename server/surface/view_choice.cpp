#include "server/surface/view_choice.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kMostForward = 0.35;  // of the distance, along the axis
constexpr double kInside = 0.35;       // of the picture's width, from its middle
constexpr double kSameSide = 0.35;     // what a view loses by being beside one that is chosen
constexpr double kMostOverlapTurn_rad = 0.9;

struct Rated {
  std::int64_t id = 0;
  double score = 0;
  Eigen::Vector2d side = Eigen::Vector2d::Zero();  // parallax of the distance
};

}  // namespace

double ApartBy(const KeyframePlace& a, const KeyframePlace& b, const SurfaceOptions& options) {
  const double moved =
      (a.world_from_camera.translation - b.world_from_camera.translation).norm() / a.distance_m;
  return moved / options.apart_share +
         RotationAngle(a.world_from_camera, b.world_from_camera) / options.apart_rad;
}

bool Overlap(const Rigid3& world_from_a, const Rigid3& world_from_b, const Pinhole& b,
             double distance) {
  const Rigid3 b_from_a = world_from_b.Inverse() * world_from_a;
  if (RotationAngle(Rigid3(), b_from_a) > kMostOverlapTurn_rad) return false;
  const Eigen::Vector3d middle = b_from_a * Eigen::Vector3d(0, 0, distance);
  if (middle.z() < 0.3 * distance || middle.z() > 3.0 * distance) return false;
  const double reach = kInside * b.width;
  return std::abs(middle.x() / middle.z()) * b.focal_px < reach &&
         std::abs(middle.y() / middle.z()) * b.focal_px < reach;
}

std::vector<std::int64_t> ChooseViews(const Rigid3& world_from_reference, double distance,
                                      std::span<const ViewCandidate> candidates,
                                      const SurfaceOptions& options) {
  std::vector<Rated> rated;
  for (const ViewCandidate& candidate : candidates) {
    const Rigid3 reference_from_view = world_from_reference.Inverse() * candidate.world_from_camera;
    if (RotationAngle(Rigid3(), reference_from_view) > options.most_turn_rad) continue;
    const Eigen::Vector3d centre = reference_from_view.translation / distance;
    if (std::abs(centre.z()) > kMostForward) continue;
    const double share = centre.head<2>().norm();
    if (share < options.least_parallax_share || share > options.most_parallax_share) continue;
    if (!Overlap(world_from_reference, candidate.world_from_camera, candidate.camera, distance)) {
      continue;
    }
    const double ratio = share / options.best_parallax_share;
    rated.push_back({candidate.id, std::min(ratio, 1.0 / ratio), centre.head<2>()});
  }
  std::vector<std::int64_t> chosen;
  while (!rated.empty() && static_cast<int>(chosen.size()) < options.views) {
    const auto best =
        std::max_element(rated.begin(), rated.end(), [](const Rated& a, const Rated& b) {
          return std::pair(a.score, a.id) < std::pair(b.score, b.id);
        });
    const Rated taken = *best;
    rated.erase(best);
    chosen.push_back(taken.id);
    for (Rated& other : rated) {
      const double along = other.side.normalized().dot(taken.side.normalized());
      const double apart = (other.side - taken.side).norm() / options.best_parallax_share;
      other.score -= kSameSide * std::max(0.0, along) * std::exp(-apart);
    }
  }
  return chosen;
}

}  // namespace saccade
