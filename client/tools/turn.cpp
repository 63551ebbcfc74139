#include "client/tools/turn.hpp"

#include <cmath>

namespace saccade::tools {
namespace {

Eigen::Vector3d HandleDirection(const Eigen::Quaterniond& world_from_mark) {
  return world_from_mark * Eigen::Vector3d(0, -1, 0);
}

}  // namespace

bool IsTurnable(const Annotation& mark) {
  return mark.shape == AnnotationShape::kArrow || mark.shape == AnnotationShape::kBox;
}

double HandleLength(const Annotation& mark) {
  if (mark.shape != AnnotationShape::kBox) return 2 * mark.size_m;
  return 0.5 * mark.extent_m.y() + 0.25 * mark.extent_m.norm();
}

Eigen::Vector3d HandlePoint(const Annotation& mark) {
  const Eigen::Quaterniond turn = mark.world_from_mark.value_or(Eigen::Quaterniond::Identity());
  return mark.anchor.point_in_world + HandleLength(mark) * HandleDirection(turn);
}

std::optional<Eigen::Quaterniond> TurnedTo(const View& view, const Eigen::Vector2d& pixel,
                                           const Eigen::Vector3d& anchor_in_world, double length_m,
                                           const Eigen::Quaterniond& world_from_mark) {
  const std::optional<Eigen::Vector3d> towards = view.Ray(pixel);
  if (!towards) return std::nullopt;
  const Eigen::Vector3d before = HandleDirection(world_from_mark);
  const Eigen::Vector3d to_anchor = anchor_in_world - view.eye();
  const Eigen::Vector3d off = to_anchor.dot(*towards) * *towards - to_anchor;
  const double rest = length_m * length_m - off.squaredNorm();
  const double side = before.dot(*towards) > 0 ? 1 : -1;
  Eigen::Vector3d after = off;
  if (rest > 0) after += side * std::sqrt(rest) * *towards;
  if (after.norm() < 1e-9) return std::nullopt;
  const auto turn = Eigen::Quaterniond::FromTwoVectors(before, after);
  return (turn * world_from_mark).normalized();
}

Eigen::Quaterniond TurnedBy(const View& view, const Eigen::Quaterniond& world_from_mark,
                            double angle_rad, bool tips) {
  const Eigen::Vector3d axis = tips ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d in_world = view.world_from_camera.rotation * axis;
  return (Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, in_world)) * world_from_mark)
      .normalized();
}

}  // namespace saccade::tools
