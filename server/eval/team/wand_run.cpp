#include "server/eval/team/wand_run.hpp"

#include <cmath>

#include "server/eval/score.hpp"

namespace saccade {
namespace {

struct Aligned {
  Rigid3 reference_from_world;
  double rms_m = 0.0, rms_deg = 0.0;
  std::size_t poses = 0;
};

std::optional<Aligned> Align(const Trajectory& estimate, const Trajectory& reference) {
  const std::vector<PosePair> pairs = Associate(estimate, reference);
  if (pairs.size() < 3) return std::nullopt;
  std::vector<Eigen::Vector3d> source, target;
  for (const PosePair& pair : pairs) {
    source.push_back(pair.estimate.translation);
    target.push_back(pair.truth.translation);
  }
  Aligned aligned;
  aligned.reference_from_world =
      AlignPoints(source, target, TrajectoryAlignment::kSe3).target_from_source;
  double sum_m2 = 0.0, sum_rad2 = 0.0;
  for (const PosePair& pair : pairs) {
    const Rigid3 there = aligned.reference_from_world * pair.estimate;
    sum_m2 += (there.translation - pair.truth.translation).squaredNorm();
    sum_rad2 += std::pow(RotationAngle(there, pair.truth), 2);
  }
  aligned.poses = pairs.size();
  aligned.rms_m = std::sqrt(sum_m2 / static_cast<double>(pairs.size()));
  aligned.rms_deg = std::sqrt(sum_rad2 / static_cast<double>(pairs.size())) * 180.0 / M_PI;
  return aligned;
}

}  // namespace

absl::StatusOr<WandResult> RunWand(const WandData& data) {
  const absl::StatusOr<CornerOrder> order = FindCornerOrder(data.lenses, data.body, data.sights);
  if (!order.ok()) return order.status();
  WandResult result;
  result.order = *order;
  WandTeam team(data.lenses, data.body, WandStartOptions());
  std::size_t next = 0;
  for (std::size_t instant = 0; instant < data.times_ns.size(); ++instant) {
    std::vector<TagSight> here;
    while (next < data.sights.size() && data.sights[next].instant == static_cast<int>(instant)) {
      here.push_back(data.sights[next++]);
    }
    team.Add(here, *order);
    if (const auto& wand = team.poses().world_from_wand[instant]) {
      result.online.push_back({data.times_ns[instant], *wand});
    }
    for (std::size_t c = 0; c < data.lenses.size(); ++c) {
      if (team.poses().world_from_camera[c]) {
        result.first_placed.try_emplace(static_cast<int>(c), instant);
      }
    }
  }
  team.Finish();
  if (!team.fit()) {
    return absl::FailedPreconditionError(
        "no camera ever sees the wand so that its pose is sure; show it two tags at once");
  }
  result.reference = team.reference();
  result.fit = *team.fit();
  for (std::size_t instant = 0; instant < data.times_ns.size(); ++instant) {
    if (const auto& wand = team.poses().world_from_wand[instant]) {
      result.wand.push_back({data.times_ns[instant], *wand});
    }
  }
  for (std::size_t c = 0; c < data.lenses.size(); ++c) {
    if (const auto& camera = team.poses().world_from_camera[c]) {
      result.world_from_camera.emplace(static_cast<int>(c), *camera);
    }
  }
  return result;
}

std::optional<WandScore> ScoreWand(const WandData& data, const WandResult& result) {
  const std::optional<Aligned> whole = Align(result.wand, data.reference_wand);
  if (!whole) return std::nullopt;
  WandScore score;
  score.poses = whole->poses;
  score.wand_rms_m = whole->rms_m;
  score.wand_rms_deg = whole->rms_deg;
  if (const auto online = Align(result.online, data.reference_wand)) {
    score.online_rms_m = online->rms_m;
  }
  for (const auto& [camera, reference] : data.reference_cameras) {
    const auto found = result.world_from_camera.find(camera);
    if (found == result.world_from_camera.end()) continue;
    const Rigid3 there = whole->reference_from_world * found->second;
    score.cameras[camera] = {(there.translation - reference.translation).norm(),
                             RotationAngle(there, reference) * 180.0 / M_PI};
  }
  return score;
}

}  // namespace saccade
