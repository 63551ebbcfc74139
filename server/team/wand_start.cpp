#include "server/team/wand_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr double kSureRatio = 2.0;  // of the two answers' errors (slam-spec 7)
constexpr int kEnough = 3;  // views that must agree before a camera is placed by unsure ones

}  // namespace

WandTeam::Candidates WandTeam::CandidatesOf(const WandView& view,
                                            const std::vector<TagSight>& sights,
                                            const CornerOrder& order) const {
  std::vector<const TagSight*> own;
  for (const TagSight& sight : sights) {
    if (sight.camera == view.camera) own.push_back(&sight);
  }
  const auto answers =
      AnswersOf(lenses_[static_cast<std::size_t>(view.camera)], body_, view, own, order);
  Candidates candidates;
  for (const auto& [error, pose] : answers) candidates.camera_from_wand.push_back(pose);
  // Two tags or more lie in no plane; one is sure where its mirror fits clearly worse.
  candidates.sure = !answers.empty() && answers[0].first < 4 * options_.sigma_px &&
                    own.size() >= 2 &&
                    (answers.size() < 2 ||
                     answers[1].first > kSureRatio * std::max(answers[0].first, options_.sigma_px));
  return candidates;
}

void WandTeam::Add(const std::vector<TagSight>& sights, const CornerOrder& order) {
  poses_.world_from_camera.resize(lenses_.size());
  const int instant = instants_++;
  poses_.world_from_wand.resize(static_cast<std::size_t>(instants_));
  std::vector<TagSight> here = sights;
  for (TagSight& sight : here) sight.instant = instant;
  begin_.push_back(views_.size());
  for (WandView& view : ViewsOf(body_, here, order)) {
    candidates_.push_back(CandidatesOf(view, here, order));
    views_.push_back(std::move(view));
  }
  if (reference_ < 0 && !Begin()) return;
  for (bool more = true; more;) {
    more = PlaceWands();
    const bool camera = PlaceCameras();
    if (camera) Adjust(10);
    more = more || camera;
  }
  // All of it now and then, at times that grow with it; else the newest body between cameras that
  // stay: the work for an instant does not grow without end.
  if (instants_ >= adjust_at_) {
    Adjust(4);
    adjust_at_ = instants_ + 1 + instants_ / 50;
  } else {
    const std::vector<WandView> newest(views_.begin() + static_cast<std::ptrdiff_t>(begin_.back()),
                                       views_.end());
    AdjustWand(lenses_, newest, kAllCameras, options_.sigma_px, 10, poses_);
  }
}

bool WandTeam::Begin() {
  // The first instant that several cameras see, one of them surely: that one is the world.
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (!candidates_[k].sure) continue;
    reference_ = views_[k].camera;
    poses_.world_from_camera[static_cast<std::size_t>(reference_)] = Rigid3();
    return true;
  }
  return false;
}

bool WandTeam::PlaceWands() {
  bool placed = false;
  for (int instant = 0; instant < instants_; ++instant) {
    auto& wand = poses_.world_from_wand[static_cast<std::size_t>(instant)];
    if (wand) continue;
    std::vector<std::size_t> seen;
    const auto at = static_cast<std::size_t>(instant);
    const std::size_t end = at + 1 < begin_.size() ? begin_[at + 1] : views_.size();
    for (std::size_t k = begin_[at]; k < end; ++k) {
      if (poses_.world_from_camera[static_cast<std::size_t>(views_[k].camera)]) seen.push_back(k);
    }
    // Of all that the views say, what most corners agree with.
    double best = std::numeric_limits<double>::infinity(), second = best;
    std::optional<Rigid3> pose;
    bool sure = false;
    for (const std::size_t k : seen) {
      const Rigid3& camera = *poses_.world_from_camera[static_cast<std::size_t>(views_[k].camera)];
      for (std::size_t c = 0; c < candidates_[k].camera_from_wand.size(); ++c) {
        const Rigid3 there = camera * candidates_[k].camera_from_wand[c];
        double cost = 0.0;
        for (const std::size_t other : seen) {
          const auto lens = static_cast<std::size_t>(views_[other].camera);
          const auto error = ViewError(lenses_[lens], views_[other],
                                       poses_.world_from_camera[lens]->Inverse() * there);
          const double part = error ? *error / options_.agrees_px : 10.0;
          cost += std::log1p(part * part);
        }
        const bool same = pose && RotationAngle(*pose, there) < 0.3;
        if (cost < best) {
          if (pose && !same) second = best;
          best = cost;
          pose = there;
          sure = candidates_[k].sure && c == 0;
        } else if (!same) {
          second = std::min(second, cost);
        }
      }
    }
    if (!pose || (!sure && (seen.size() < 2 || second - best < 0.7))) continue;
    wand = pose;
    placed = true;
  }
  return placed;
}

double WandTeam::Agreement(int camera, const Rigid3& world_from_camera) const {
  double agreement = 0.0;
  for (const WandView& view : views_) {
    const auto& wand = poses_.world_from_wand[static_cast<std::size_t>(view.instant)];
    if (view.camera != camera || !wand) continue;
    const auto error = ViewError(lenses_[static_cast<std::size_t>(camera)], view,
                                 world_from_camera.Inverse() * *wand);
    if (!error) continue;
    const double part = *error / (3 * options_.agrees_px);
    agreement += 1.0 / (1.0 + part * part);
  }
  return agreement;
}

bool WandTeam::PlaceCameras() {
  bool placed = false;
  for (std::size_t c = 0; c < lenses_.size(); ++c) {
    if (poses_.world_from_camera[c]) continue;
    double best = 0.0;
    int views = 0;
    bool sure = false;
    std::optional<Rigid3> pose;
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector2d> pixels;
    for (std::size_t k = 0; k < views_.size(); ++k) {
      const auto& wand = poses_.world_from_wand[static_cast<std::size_t>(views_[k].instant)];
      if (views_[k].camera != static_cast<int>(c) || !wand) continue;
      ++views;
      sure = sure || candidates_[k].sure;
      for (std::size_t p = 0; p < views_[k].points.size(); ++p) {
        points.push_back(*wand * views_[k].points[p]);
        pixels.push_back(views_[k].pixels[p]);
      }
      for (const Rigid3& candidate : candidates_[k].camera_from_wand) {
        const Rigid3 there = *wand * candidate.Inverse();
        const double agreement = Agreement(static_cast<int>(c), there);
        if (agreement > best) {
          best = agreement;
          pose = there;
        }
      }
    }
    if (!pose || (!sure && views < kEnough)) continue;
    PoseFitOptions options;
    options.huber_px = 5.0;
    const auto fit = FitPose(lenses_[c], points, pixels, *pose, options);
    if (fit.ok() && Agreement(static_cast<int>(c), fit->world_from_camera) >= best) {
      pose = fit->world_from_camera;
    }
    poses_.world_from_camera[c] = pose;
    placed = true;
  }
  return placed;
}

void WandTeam::Adjust(int iterations) {
  auto fit = AdjustWand(lenses_, views_, reference_, options_.sigma_px, iterations, poses_);
  if (fit) fit_ = std::move(fit);
}

bool WandTeam::Reconsider() {
  bool changed = false;
  for (std::size_t c = 0; c < lenses_.size(); ++c) {
    if (!poses_.world_from_camera[c] || static_cast<int>(c) == reference_) continue;
    int views = 0, wrong = 0;
    for (const WandView& view : views_) {
      const auto& wand = poses_.world_from_wand[static_cast<std::size_t>(view.instant)];
      if (view.camera != static_cast<int>(c) || !wand) continue;
      const auto error =
          ViewError(lenses_[c], view, poses_.world_from_camera[c]->Inverse() * *wand);
      ++views;
      wrong += !error || *error > options_.agrees_px ? 1 : 0;
    }
    if (2 * wrong <= views) continue;
    poses_.world_from_camera[c].reset();
    changed = true;
  }
  return changed;
}

void WandTeam::Finish() {
  if (reference_ < 0) return;
  Adjust(100);
  // A camera that most of its views contradict looks the other way: placed anew, once.
  if (Reconsider()) {
    PlaceCameras();
    Adjust(100);
    Reconsider();
  }
}

}  // namespace saccade
