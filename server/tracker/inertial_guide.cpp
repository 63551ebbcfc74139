#include "server/tracker/inertial_guide.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

constexpr Timestamp kMargin_ns = 100'000'000;  // clocks differ by less

}  // namespace

ImuStep InertialGuide::Between(Timestamp from_ns, Timestamp to_ns) {
  samples_ = feed_->Between(from_ns - kMargin_ns, to_ns + kMargin_ns);
  return {samples_, from_ns, to_ns, feed_->info().noise};
}

void InertialGuide::Record(Timestamp time_ns, const Rigid3& world_from_camera, double distance) {
  poses_.push_back({time_ns, world_from_camera, options_.position_share * distance,
                    options_.rotation_sigma_rad});
  while (seen_s() > options_.longest_s + options_.apart_s) poses_.pop_front();
}

void InertialGuide::Move(const Similarity3& world_from_before) {
  for (SeenPose& pose : poses_) {
    pose.world_from_camera = world_from_before.Move(pose.world_from_camera);
    pose.position_sigma *= world_from_before.scale;
  }
}

double InertialGuide::seen_s() const {
  return poses_.empty() ? 0.0 : Seconds(poses_.back().time_ns - poses_.front().time_ns);
}

std::optional<InertialSolution> InertialGuide::Find() const {
  if (seen_s() < options_.shortest_s) return std::nullopt;
  std::vector<SeenPose> chosen;  // from the newest back
  for (auto pose = poses_.rbegin(); pose != poses_.rend(); ++pose) {
    if (chosen.empty() || Seconds(chosen.back().time_ns - pose->time_ns) >= options_.apart_s) {
      chosen.push_back(*pose);
    }
  }
  std::ranges::reverse(chosen);
  const ImuTrack samples =
      feed_->Between(chosen.front().time_ns - kMargin_ns, chosen.back().time_ns + kMargin_ns);
  auto found = SolveInertialStart(chosen, samples, feed_->info(), InertialStartOptions());
  if (!found || found->misfit > options_.worst_misfit) return std::nullopt;
  const double wanted = patient() ? options_.good_sigma : options_.poor_sigma;
  if (found->scale_sigma > wanted) return std::nullopt;
  return found;
}

}  // namespace saccade
