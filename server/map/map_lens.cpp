// The part of the map that learns a lens, and changes to it.
#include "server/map/map.hpp"

namespace saccade {
namespace {

constexpr std::size_t kFewestKeyframesForLens = 6;

/// As seen through the new lens what was seen on `ray` through the old one; `ray` where one of them
/// has no place for it.
Eigen::Vector3d Reray(const CameraModel& before, const CameraModel& after,
                      const Eigen::Vector3d& ray) {
  const auto pixel = before.Project(ray);
  const auto seen = pixel ? after.Unproject(*pixel) : std::nullopt;
  return seen ? *seen : ray;
}

}  // namespace

std::optional<KeyframeGraph::LensJob> Map::MakeLensJob(const CameraModel& lens,
                                                       const FilterState& filter) const {
  if (keyframes_.size() < kFewestKeyframesForLens) return std::nullopt;
  return keyframes_.MakeLensJob(lens, [&](FeatureId id) -> std::optional<GraphEstimate> {
    if (!filter.Has(id)) return std::nullopt;
    const PointFromClone point = filter.Point(id);
    return GraphEstimate{point.bearing, point.inverse_range};
  });
}

void Map::TakeLens(const KeyframeGraph::LensJob& job, const CameraModel& before,
                   const std::shared_ptr<const CameraModel>& after, FilterState& filter) {
  const auto reray = [&](const Eigen::Vector3d& ray) { return Reray(before, *after, ray); };
  const std::optional<Rigid3> newest = keyframes_.Newest();
  const KeyframeGraph::LensChange change{reray,
                                         after->RadiansPerPixel() / before.RadiansPerPixel()};
  keyframes_.TakeLens(job, change);
  Refinement refinement;
  ForgetClones(filter);
  for (const auto& [id, clone] : clones_) {
    if (const auto pose = keyframes_.Pose(id)) refinement.clones[clone] = *pose;
  }
  std::map<FeatureId, const LensBundle::Point*> adjusted;
  for (std::size_t k = 0; k < job.points.size(); ++k) {
    adjusted[job.points[k]] = &job.problem.points[k];
  }
  for (const FeatureId id : filter.FeatureIds()) {
    const auto known = adjusted.find(id);
    if (known != adjusted.end()) {
      refinement.features[id] = {known->second->bearing, known->second->inverse_range};
    } else {
      const PointFromClone point = filter.Point(id);
      refinement.features[id] = {reray(point.bearing), point.inverse_range};
    }
  }
  if (newest) {
    refinement.world_from_camera =
        *keyframes_.Newest() * (newest->Inverse() * filter.camera().world_from_camera);
  }
  filter.DropCheckpoint();
  filter.SetCheckpoint();  // of now: what the filter has seen since is in the job's neighbours
  filter.Refine(refinement);
  const auto see = [&](Landmark& landmark) {
    if (!landmark.patch.camera) return;
    landmark.patch.birth_bearing = reray(landmark.patch.birth_bearing);
    landmark.patch.camera = after;
  };
  for (Landmark& landmark : in_use_.all()) see(landmark);
  at_rest_.ForEach(see);
}

}  // namespace saccade
