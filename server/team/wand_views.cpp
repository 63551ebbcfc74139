#include "server/team/wand_views.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

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

}  // namespace

std::vector<std::pair<double, Rigid3>> AnswersOf(const CameraModel& lens, const WandBody& body,
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
          AnswersOf(lenses[static_cast<std::size_t>(key.second)], body, view, seen, order);
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

}  // namespace saccade
