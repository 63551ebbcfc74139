// What a SurfaceMap does step by step: sweeps, confirms, fuses, follows.
#include <algorithm>
#include <cmath>

#include "server/pipeline/frame_cost.hpp"
#include "server/surface/surface_map.hpp"
#include "server/surface/view_choice.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostAsked = 10;     // keyframes that confirm one
constexpr double kSweptAgain_px = 0.7;     // of a small picture, that a view has moved
constexpr double kFarFromAsked = 0.6;      // of the distance
constexpr int kFollowEvery = 8;            // keyframes
constexpr double kFarMoved = 3.0;          // times what is worth following: at once
constexpr int kConfirmedAt[] = {2, 4, 8};  // keyframes asked: then it is done again

}  // namespace

/// By what lengths have changed since the depth was found: the views that it was found from are
/// that much farther away.
float SurfaceMap::LengthFactor(const Kept& kept) const {
  std::vector<double> ratios;
  for (const auto& [id, then] : kept.swept) {
    const auto view = kept_.find(id);
    if (view == kept_.end()) continue;
    const Rigid3 now =
        view->second.place.world_from_camera.Inverse() * kept.place.world_from_camera;
    ratios.push_back(now.translation.norm() / std::max(1e-9, then.translation.norm()));
  }
  if (ratios.empty()) return 1.0f;
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  return static_cast<float>(ratios[ratios.size() / 2]);
}

bool SurfaceMap::SweptElsewhere(const Kept& kept) const {
  const double factor = LengthFactor(kept);
  int moved = 0, all = 0;
  for (const auto& [id, then] : kept.swept) {
    const auto view = kept_.find(id);
    if (view == kept_.end()) continue;
    const Rigid3 now =
        view->second.place.world_from_camera.Inverse() * kept.place.world_from_camera;
    const double turn = RotationAngle(now, then);
    const double shift =
        (now.translation - factor * then.translation).norm() / kept.place.distance_m;
    ++all;
    moved += (turn + shift) * kept.picture.camera.focal_px > kSweptAgain_px ? 1 : 0;
  }
  return 2 * moved > all;
}

std::vector<std::int64_t> SurfaceMap::ViewsOf(std::int64_t id, const Kept& kept) const {
  std::vector<ViewCandidate> candidates;
  for (const auto& [other, each] : kept_) {
    if (other == id) continue;
    candidates.push_back({other, each.place.world_from_camera, each.picture.camera});
  }
  return ChooseViews(kept.place.world_from_camera, kept.place.distance_m, candidates, options_);
}

bool SurfaceMap::Work() {
  if (ConfirmNext()) return true;
  const double begin_ms = ThreadCpuMs();
  if (fusion_ && fusion_->Work()) {
    cost_.mesh_ms += ThreadCpuMs() - begin_ms;
    return true;
  }
  return FollowMoved() || SweepNext() || SweepAgain();
}

bool SurfaceMap::ConfirmNext() {
  for (auto& [id, kept] : kept_) {
    if (!kept.confirm_due) continue;
    kept.confirm_due = false;
    Confirm(id, kept);
    return true;
  }
  return false;
}

/// Since its depth was fused; above 1: worth following.
double SurfaceMap::Moved(const Kept& kept) const {
  if (!kept.fused || !fusion_) return 0.0;
  const Rigid3& then = kept.fused->world_from_camera;
  const Rigid3& now = kept.place.world_from_camera;
  const double moved = (then.translation - now.translation).norm() +
                       kept.place.distance_m * RotationAngle(then, now);
  const double stretched =
      kept.place.distance_m * std::abs(LengthFactor(kept) / kept.fused->length_factor - 1.0f);
  return (moved + stretched) / (options_.moved_share * kept.place.distance_m);
}

/// All at once, and small moves not each time: blocks that several of them show are made anew once.
bool SurfaceMap::FollowMoved() {
  const bool due = cost_.keyframes >= followed_at_ + kFollowEvery;
  const double least = due ? 1.0 : kFarMoved;
  const bool any = std::any_of(kept_.begin(), kept_.end(),
                               [&](const auto& each) { return Moved(each.second) > least; });
  if (!any) return false;
  followed_at_ = cost_.keyframes;
  for (auto& [id, kept] : kept_) {
    if (Moved(kept) <= 1.0) continue;
    Fuse(id, kept, kept.fused->depth);
  }
  return true;
}

bool SurfaceMap::SweepAgain() {
  return std::any_of(kept_.begin(), kept_.end(), [this](auto& each) {
    return each.second.depth && SweptElsewhere(each.second) && Sweep(each.first, each.second);
  });
}

bool SurfaceMap::SweepNext() {
  int newer = 0;
  for (auto at = kept_.rbegin(); at != kept_.rend(); ++at, ++newer) {
    Kept& kept = at->second;
    if (kept.depth || kept.tried || newer < options_.newer_keyframes) continue;
    kept.tried = true;
    const bool near = std::any_of(kept_.begin(), kept_.end(), [&](const auto& each) {
      return each.second.depth &&
             ApartBy(kept.place, each.second.place, options_) < options_.depth_apart;
    });
    if (near) continue;
    if (Sweep(at->first, kept)) return true;
  }
  return false;
}

bool SurfaceMap::Sweep(std::int64_t id, Kept& kept) {
  const std::vector<std::int64_t> chosen = ViewsOf(id, kept);
  if (static_cast<int>(chosen.size()) < options_.fewest_views) return false;
  const double begin_ms = ThreadCpuMs();
  std::vector<SweepView> views;
  kept.swept.clear();
  for (const std::int64_t other : chosen) {
    const Kept& view = kept_.at(other);
    const Rigid3 view_from_this =
        view.place.world_from_camera.Inverse() * kept.place.world_from_camera;
    views.push_back({&view.picture, view_from_this});
    kept.swept.emplace_back(other, view_from_this);
  }
  const double nearest = options_.nearest_inverse / kept.place.distance_m;
  const double farthest = options_.farthest_inverse / kept.place.distance_m;
  const SweepPlanes planes{static_cast<float>(farthest),
                           static_cast<float>((nearest - farthest) / (options_.planes - 1)),
                           options_.planes};
  kept.depth = FindDepth(kept.picture, views, planes, options_);
  ++cost_.depths;
  cost_.known_share += kept.depth->KnownShare();
  cost_.depth_ms += ThreadCpuMs() - begin_ms;
  kept.confirmed_by = 0;
  kept.confirm_due = true;
  for (auto& [other, each] : kept_) {
    if (other == id || !each.depth || each.confirm_due) continue;
    if (each.confirmed_by >= kConfirmedAt[2]) continue;
    each.confirm_due = Overlap(kept.place.world_from_camera, each.place.world_from_camera,
                               each.picture.camera, kept.place.distance_m);
  }
  return true;
}

void SurfaceMap::Confirm(std::int64_t id, Kept& kept) {
  const double begin_ms = ThreadCpuMs();
  std::vector<std::pair<double, OtherDepth>> asked;
  const double distance = kept.place.distance_m;
  for (const auto& [other, each] : kept_) {
    if (other == id || !each.depth) continue;
    const Rigid3 other_from_this =
        each.place.world_from_camera.Inverse() * kept.place.world_from_camera;
    const double away = other_from_this.translation.norm() / distance;
    if (away > kFarFromAsked || !Overlap(kept.place.world_from_camera, each.place.world_from_camera,
                                         each.picture.camera, distance)) {
      continue;
    }
    asked.emplace_back(away, OtherDepth{&*each.depth, LengthFactor(each), other_from_this});
  }
  std::sort(asked.begin(), asked.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  if (asked.size() > kMostAsked) asked.resize(kMostAsked);
  const int count = static_cast<int>(asked.size());
  const auto step = [](int n) {
    return static_cast<int>(std::count_if(std::begin(kConfirmedAt), std::end(kConfirmedAt),
                                          [n](int at) { return n >= at; }));
  };
  if (step(count) <= step(kept.confirmed_by) && (kept.fused || step(count) == 0)) return;
  kept.confirmed_by = count;
  std::vector<OtherDepth> others;
  for (auto& [away, other] : asked) others.push_back(other);
  const DepthMap confirmed = KeepConfirmed(*kept.depth, LengthFactor(kept), others, options_);
  cost_.confirmed_share += confirmed.KnownShare();
  cost_.confirm_ms += ThreadCpuMs() - begin_ms;
  Fuse(id, kept, confirmed);
}

void SurfaceMap::Fuse(std::int64_t id, Kept& kept, const DepthMap& depth) {
  const double begin_ms = ThreadCpuMs();
  if (!fusion_) {
    const double fresh = metric_ ? options_.voxel_m : options_.voxel_share * kept.place.distance_m;
    const double voxel = restored_voxel_ > 0.0f ? restored_voxel_ : fresh;
    fusion_ = std::make_unique<SurfaceFusion>(static_cast<float>(voxel), options_);
    fusion_->StartVersionsAt(version_);
  }
  FusedView view;
  view.depth = depth;
  view.color = kept.picture.color;
  view.length_factor = LengthFactor(kept);
  view.distance = static_cast<float>(kept.place.distance_m);
  view.world_from_camera = kept.place.world_from_camera;
  kept.fused = view;
  fusion_->Set(id, std::move(view));
  ++cost_.fused;
  cost_.fuse_ms += ThreadCpuMs() - begin_ms;
}

}  // namespace saccade
