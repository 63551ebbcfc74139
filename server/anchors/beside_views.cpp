#include "server/anchors/beside_views.hpp"

#include <algorithm>
#include <optional>

namespace saccade {
namespace {

constexpr FrameId kLookBack = 270;  // frames
constexpr std::size_t kKept = 300;  // longer than frames are

PoseTrail::Pose PoseOf(const MapSnapshot& snapshot) {
  return {snapshot.frame_id, snapshot.status == TrackingStatus::kTracking, snapshot.map_generation,
          snapshot.world_from_camera};
}

}  // namespace

void PoseTrail::Add(const MapSnapshot& snapshot) {
  if (!poses_.empty() && snapshot.frame_id <= poses_.back().id) poses_.clear();
  poses_.push_back(PoseOf(snapshot));
  if (poses_.size() > kKept) poses_.pop_front();
}

const PoseTrail::Pose* PoseTrail::Find(FrameId id) const {
  const auto found =
      std::lower_bound(poses_.begin(), poses_.end(), id,
                       [](const Pose& pose, FrameId wanted) { return pose.id < wanted; });
  return found == poses_.end() || found->id != id ? nullptr : &*found;
}

std::vector<BesideView> ViewsFromBeside(const PastFrame& clicked, const Eigen::Vector3d& bearing,
                                        double range_m, FrameId newest, const FrameLookup& frames,
                                        const PoseTrail* trail, const BesideOptions& options) {
  struct Candidate {
    FrameId id = 0;
    std::optional<PastFrame> past;
    Rigid3 view_from_clicked;
    double parallax_px = 0.0;
  };
  std::vector<Candidate> candidates;
  const MapSnapshot& then = *clicked.snapshot;
  const double focal_px = clicked.frame->camera->intrinsics().fx;
  const FrameId first = newest > kLookBack ? newest - kLookBack : 0;
  for (FrameId id = newest; id >= first; id -= std::min(id, options.stride)) {
    Candidate candidate{id, std::nullopt, {}, 0.0};
    std::optional<PoseTrail::Pose> pose;
    if (trail != nullptr) {
      if (const PoseTrail::Pose* known = trail->Find(id)) pose = *known;
    } else if (absl::StatusOr<PastFrame> past = frames(id); past.ok()) {
      pose = PoseOf(*past->snapshot);
      candidate.past = *std::move(past);
    }
    if (pose && pose->tracking && pose->map_generation == then.map_generation) {
      candidate.view_from_clicked = pose->world_from_camera.Inverse() * then.world_from_camera;
      const Eigen::Vector3d base = candidate.view_from_clicked.Inverse().translation;
      candidate.parallax_px = focal_px * base.cross(bearing).norm() / range_m;
      if (candidate.parallax_px >= options.least_parallax_px &&
          candidate.parallax_px <= options.most_parallax_px) {
        candidates.push_back(std::move(candidate));
      }
    }
    if (id == 0) break;
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.parallax_px > b.parallax_px; });
  std::vector<BesideView> views;
  for (Candidate& candidate : candidates) {
    if (views.size() == options.most) break;
    if (!candidate.past) {
      absl::StatusOr<PastFrame> past = frames(candidate.id);
      if (!past.ok()) continue;
      candidate.past = *std::move(past);
    }
    views.push_back(
        {*std::move(candidate.past), candidate.view_from_clicked, candidate.parallax_px});
  }
  return views;
}

}  // namespace saccade
