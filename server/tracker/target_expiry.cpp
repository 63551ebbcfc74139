#include "server/tracker/target_expiry.hpp"

#include <optional>

#include "server/filter/new_clone.hpp"

namespace saccade {
namespace {

constexpr double kDepthSigma = 0.01;  // of the range

}  // namespace

void LetTargetGo(const Frame& frame, const FrameMatcher& matcher, FrontEnd& front_end,
                 Births& births, FrameMatches& matches, Map& map, FilterState& filter) {
  std::optional<NewClone> clone;
  const Rigid3 camera_from_world = filter.camera().world_from_camera.Inverse();
  for (const LandmarkMatch& match : matches.in_view) {
    const auto* point = std::get_if<Eigen::Vector3d>(&match.point);
    if (point == nullptr || !match.accepted()) continue;
    if (!clone) clone.emplace(filter);
    const double inverse = 1.0 / (camera_from_world * *point).norm();
    births.Plant(frame, match.pixel, {inverse, kDepthSigma * inverse}, clone->id(), matches.motion,
                 matcher, front_end, filter, map.in_use());
  }
  std::vector<FeatureId> expired;
  for (const Landmark& landmark : map.in_use().all()) {
    if (landmark.known) expired.push_back(landmark.id);
  }
  map.in_use().Remove(expired);
  std::erase_if(matches.in_view, [](const LandmarkMatch& match) {
    return std::holds_alternative<Eigen::Vector3d>(match.point);
  });
}

}  // namespace saccade
