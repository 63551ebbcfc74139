#include "server/team/wand_start.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr double kSureRatio = 2.0;  // of the two answers' errors (slam-spec 7)
constexpr int kEnough = 3;  // views that must agree before a camera is placed by unsure ones

std::array<Eigen::Vector3d, 4> CornersOf(double side_m) {
  const double h = 0.5 * side_m;
  return {Eigen::Vector3d(-h, -h, 0), {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
}

std::vector<CornerOrder> AllOrders() {
  std::vector<CornerOrder> orders;
  for (const int step : {1, 3}) {
    for (int first = 0; first < 4; ++first) {
      CornerOrder order{};
      for (int k = 0; k < 4; ++k) order[static_cast<std::size_t>(k)] = (first + step * k) % 4;
      orders.push_back(order);
    }
  }
  return orders;
}

void AddCorners(const WandBody& body, const TagSight& sight, const CornerOrder& order,
                WandView& view) {
  const auto corners = CornersOf(body.side_m);
  for (std::size_t k = 0; k < 4; ++k) {
    view.points.push_back(body.wand_from_tag.at(sight.tag) *
                          corners[static_cast<std::size_t>(order[k])]);
    view.pixels.push_back(sight.corners[k]);
  }
}

/// Both poses of one tag, refined by all that the view has; best first, without doubles.
std::vector<std::pair<double, Rigid3>> Answers(const CameraModel& lens, const WandBody& body,
                                               const WandView& view,
                                               const std::vector<const TagSight*>& sights,
                                               const CornerOrder& order) {
  std::vector<std::pair<double, Rigid3>> answers;
  const auto corners = CornersOf(body.side_m);
  for (const TagSight* sight : sights) {
    std::array<Eigen::Vector3d, 4> points;
    for (std::size_t k = 0; k < 4; ++k) points[k] = corners[static_cast<std::size_t>(order[k])];
    const auto both = FitPlanarPose(lens, points, sight->corners, PoseFitOptions());
    if (!both.ok()) continue;
    for (const PoseFit& each : *both) {
      const Rigid3 start = body.wand_from_tag.at(sight->tag) * each.world_from_camera;
      const auto all = FitPose(lens, view.points, view.pixels, start, PoseFitOptions());
      const Rigid3 pose = (all.ok() ? all->world_from_camera : start).Inverse();
      const auto error = ViewError(lens, view, pose);
      if (!error) continue;
      const bool known = std::any_of(answers.begin(), answers.end(), [&](const auto& other) {
        return RotationAngle(other.second, pose) < 0.05;
      });
      if (!known) answers.emplace_back(*error, pose);
    }
  }
  std::sort(answers.begin(), answers.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  return answers;
}

}  // namespace

std::vector<WandView> ViewsOf(const WandBody& body, const std::vector<TagSight>& sights,
                              const CornerOrder& order) {
  std::map<std::pair<int, int>, WandView> views;
  for (const TagSight& sight : sights) {
    WandView& view = views[{sight.instant, sight.camera}];
    view.camera = sight.camera;
    view.instant = sight.instant;
    AddCorners(body, sight, order, view);
  }
  std::vector<WandView> list;
  for (auto& [key, view] : views) list.push_back(std::move(view));
  return list;
}

absl::StatusOr<CornerOrder> FindCornerOrder(const std::vector<CameraModel>& lenses,
                                            const WandBody& body,
                                            const std::vector<TagSight>& sights) {
  constexpr std::size_t kViews = 12;  // are enough
  constexpr double kMost_px = 20.0;
  std::map<std::pair<int, int>, std::vector<const TagSight*>> views;
  for (const TagSight& sight : sights) views[{sight.instant, sight.camera}].push_back(&sight);
  std::erase_if(views, [](const auto& each) { return each.second.size() < 2; });
  if (views.empty()) {
    return absl::FailedPreconditionError(
        "no camera ever sees two tags at once, so the order of their corners cannot be found");
  }
  std::vector<std::pair<double, CornerOrder>> scores;
  for (const CornerOrder& order : AllOrders()) {
    double sum = 0.0;
    std::size_t used = 0;
    const std::size_t stride = std::max<std::size_t>(1, views.size() / kViews);
    std::size_t index = 0;
    for (const auto& [key, seen] : views) {
      if (index++ % stride != 0) continue;
      WandView view;
      for (const TagSight* sight : seen) AddCorners(body, *sight, order, view);
      const auto answers =
          Answers(lenses[static_cast<std::size_t>(key.second)], body, view, seen, order);
      sum += answers.empty() ? kMost_px : std::min(kMost_px, answers.front().first);
      ++used;
    }
    scores.emplace_back(sum / static_cast<double>(used), order);
  }
  std::sort(scores.begin(), scores.end());
  if (scores[0].first > 3.0 || scores[1].first < 2.0 * scores[0].first) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the order of the tags' corners cannot be told: the best fits to ", scores[0].first,
        " px, the next to ", scores[1].first, " px; check the tags' places and side"));
  }
  return scores[0].second;
}

WandTeam::Candidates WandTeam::CandidatesOf(const WandView& view,
                                            const std::vector<TagSight>& sights,
                                            const CornerOrder& order) const {
  std::vector<const TagSight*> own;
  for (const TagSight& sight : sights) {
    if (sight.camera == view.camera) own.push_back(&sight);
  }
  const auto answers =
      Answers(lenses_[static_cast<std::size_t>(view.camera)], body_, view, own, order);
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
  Adjust(4);
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
    for (std::size_t k = 0; k < views_.size(); ++k) {
      if (views_[k].instant == instant &&
          poses_.world_from_camera[static_cast<std::size_t>(views_[k].camera)]) {
        seen.push_back(k);
      }
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

void WandTeam::Finish() {
  if (reference_ >= 0) Adjust(100);
}

}  // namespace saccade
