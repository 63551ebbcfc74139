#include "server/tracker/delayed_depths.hpp"

#include <vector>

#include "server/tracker/line_time.hpp"

namespace saccade {
namespace {

constexpr double kGateSquared = 9.0;  // of a particle's ellipse, 3 sigma

DepthParticleOptions InUnits(double unit) {
  DepthParticleOptions options;
  options.min_range_m *= unit;
  options.max_range_m *= unit;
  options.least_speed_m_s *= unit;
  return options;
}

/// The one ellipse that holds those of all particles in view.
struct Union {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

std::optional<Union> UnionOf(std::span<const DepthParticle> particles) {
  double weight = 0.0;
  Union all;
  for (const DepthParticle& each : particles) {
    if (!each.pixel) continue;
    weight += each.weight;
    all.centre += each.weight * *each.pixel;
  }
  if (!(weight > 0.0)) return std::nullopt;
  all.centre /= weight;
  for (const DepthParticle& each : particles) {
    if (!each.pixel) continue;
    const Eigen::Vector2d off = *each.pixel - all.centre;
    all.spread += each.weight / weight * (each.covariance + off * off.transpose());
  }
  return all;
}

}  // namespace

void DelayedDepths::Adopt(FeatureId first, double unit, Map& map) {
  for (Landmark& landmark : map.in_use().all()) {
    if (landmark.id < first || landmark.known) continue;
    landmark.waits = true;
    searched_.emplace(landmark.id, Search{DepthParticles(InUnits(unit)), unit});
  }
}

DepthVerdict DelayedDepths::Attempt(const CameraModel& camera, const CameraMotion& motion,
                                    const FrameMatcher& matcher, const Landmark& landmark,
                                    const FilterState& filter, FrontEnd& front_end,
                                    Search& search) const {
  const auto line = filter.LineOf(landmark.id);
  if (!line) return DepthVerdict::kGone;
  DepthParticles& particles = search.particles;
  // Noise changes little over the line: that of where it was born does.
  const double sigma = matcher.PixelSigma(camera, landmark.patch.birth_pixel);
  particles.Predict(camera, *line, sigma * sigma * Eigen::Matrix2d::Identity());
  const auto all = UnionOf(particles.particles());
  if (!all) return DepthVerdict::kPartial;
  PointFromClone middle = line->line;
  middle.inverse_range = particles.inverse_range();
  const LandmarkSighting sighting =
      front_end.Find({&landmark, middle, line->world_from_camera, all->centre, all->spread});
  if (sighting.kind == LandmarkSighting::Kind::kNotSought ||
      sighting.kind == LandmarkSighting::Kind::kHidden) {
    return DepthVerdict::kPartial;
  }
  std::vector<std::optional<Eigen::Vector2d>> matches(particles.particles().size());
  const auto at = PredictFromClone(camera, line->world_from_camera, middle);
  if (sighting.kind == LandmarkSighting::Kind::kFound && at) {
    Eigen::Matrix<double, 6, 1> velocities;
    velocities << motion.velocity_m_s, motion.angular_velocity_rad_s;
    // As seen in mid-exposure.
    const Eigen::Vector2d seen = sighting.pixel - at->d_camera * velocities * filter.readout_s() *
                                                      LateInReadouts(camera, sighting.pixel);
    for (std::size_t k = 0; k < matches.size(); ++k) {
      const DepthParticle& particle = particles.particles()[k];
      if (!particle.pixel) continue;
      const Eigen::Vector2d off = seen - *particle.pixel;
      if (off.dot(particle.covariance.ldlt().solve(off)) < kGateSquared) matches[k] = seen;
    }
  }
  return particles.Update(matches);
}

void DelayedDepths::Step(const CameraModel& camera, const FrameMatches& matches,
                         const FrameMatcher& matcher, FrontEnd& front_end, Map& map,
                         FilterState& filter) {
  std::vector<FeatureId> gone;
  for (Landmark& landmark : map.in_use().all()) {
    if (!landmark.waits) continue;
    const auto at = searched_.find(landmark.id);
    if (at == searched_.end()) {  // it waited before the map was restored
      gone.push_back(landmark.id);
      continue;
    }
    Search& search = at->second;
    if (!search.particles.WorthAttempt(matches.motion.velocity_m_s)) continue;
    switch (Attempt(camera, matches.motion, matcher, landmark, filter, front_end, search)) {
      case DepthVerdict::kPartial:
        break;
      case DepthVerdict::kKnown:
        filter.TellRange(landmark.id, search.particles.inverse_range(),
                         search.particles.inverse_range_sigma());
        landmark.waits = false;
        break;
      case DepthVerdict::kGone:
        gone.push_back(landmark.id);
        break;
    }
  }
  filter.Remove(gone);
  map.in_use().Remove(gone);
  std::erase_if(searched_, [&](const auto& each) {
    const Landmark* landmark = map.in_use().Find(each.first);
    return landmark == nullptr || !landmark->waits;
  });
}

}  // namespace saccade
