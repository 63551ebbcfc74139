#include "server/team/merge/place_view.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr std::size_t kVotingPoints = 150;  // strongest points of the query
constexpr int kAlike = 40;                  // of 256 bits, at the middle scale
constexpr double kNearShare = 0.7;          // of the distance
constexpr double kNearAngle_rad = 0.7;

/// Lengths and radians into one number: a fifth of the distance counts as much as 15 degrees.
double ViewDistance(const Rigid3& a, const Rigid3& b, double distance) {
  return (a.translation - b.translation).norm() / (0.2 * distance) + RotationAngle(a, b) / 0.26;
}

}  // namespace

std::shared_ptr<const PlaceView> PlaceView::Make(TeamKeyframe keyframe) {
  auto view = std::make_shared<PlaceView>();
  view->camera = std::make_shared<const CameraModel>(keyframe.camera);
  std::vector<double> ranges;
  for (TeamPoint& point : keyframe.points) {
    DescribedPoint& described = view->described.emplace_back();
    described.pixel = point.pixel;
    described.descriptors = point.descriptors;
    described.present = point.present;
    const auto bearing = view->camera->Unproject(point.pixel);
    if (!bearing) point.range = 0.0;
    if (point.range > 0.0) ranges.push_back(point.range);
    const double range = point.range > 0.0 ? point.range : 1.0;
    view->points_in_world.push_back(
        keyframe.world_from_camera *
        (range * (bearing ? bearing->normalized() : Eigen::Vector3d::UnitZ().eval())));
  }
  view->known = static_cast<int>(ranges.size());
  if (!ranges.empty()) {
    const auto middle = ranges.begin() + std::ssize(ranges) / 2;
    std::nth_element(ranges.begin(), middle, ranges.end());
    view->distance = *middle;
  }
  view->told = std::move(keyframe);
  return view;
}

std::shared_ptr<const PlaceView> PlaceBook::Take(TeamKeyframe keyframe) {
  if (generation_ && keyframe.generation < *generation_) return nullptr;
  const auto known = views_.find(keyframe.frame);
  if (generation_ == keyframe.generation && known != views_.end() &&
      known->second->told.edition >= keyframe.edition) {
    return nullptr;
  }
  if (generation_ != keyframe.generation) views_.clear();
  generation_ = keyframe.generation;
  metric_ = keyframe.metric;
  const FrameId frame = keyframe.frame;
  auto view = PlaceView::Make(std::move(keyframe));
  views_[frame] = view;
  if (views_.size() > max_views_) DropMostRedundant();
  return view;
}

std::shared_ptr<const PlaceView> PlaceBook::Find(FrameId frame) const {
  const auto at = views_.find(frame);
  return at == views_.end() ? nullptr : at->second;
}

void PlaceBook::DropMostRedundant() {
  // The older of the two most alike: the newest is the freshest.
  auto drop = views_.begin();
  double least = std::numeric_limits<double>::max();
  for (auto a = views_.begin(); a != views_.end(); ++a) {
    for (auto b = std::next(a); b != views_.end(); ++b) {
      const double distance = ViewDistance(a->second->world_from_camera(),
                                           b->second->world_from_camera(), a->second->distance);
      if (distance < least) {
        least = distance;
        drop = a;
      }
    }
  }
  views_.erase(drop);
}

std::vector<std::shared_ptr<const PlaceView>> PlaceBook::MostAlike(const PlaceView& query,
                                                                   std::size_t most) const {
  const std::size_t voters = std::min(query.described.size(), kVotingPoints);
  std::vector<std::pair<double, std::shared_ptr<const PlaceView>>> order;
  for (const auto& [frame, view] : views_) {
    int votes = 0;
    for (std::size_t q = 0; q < voters; ++q) {
      const DescribedPoint& asked = query.described[q];
      if (!asked.present[1]) continue;
      votes +=
          std::any_of(view->described.begin(), view->described.end(),
                      [&](const DescribedPoint& point) {
                        return point.present[1] &&
                               HammingDistance(asked.descriptors[1], point.descriptors[1]) < kAlike;
                      })
              ? 1
              : 0;
    }
    order.emplace_back(-votes / std::sqrt(1.0 + static_cast<double>(view->described.size())), view);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::shared_ptr<const PlaceView>> best;
  for (std::size_t k = 0; k < std::min(most, order.size()); ++k) best.push_back(order[k].second);
  return best;
}

std::vector<std::shared_ptr<const PlaceView>> PlaceBook::Near(const Rigid3& world_from_camera,
                                                              double distance,
                                                              std::size_t most) const {
  std::vector<std::pair<double, std::shared_ptr<const PlaceView>>> order;
  for (const auto& [frame, view] : views_) {
    const Rigid3& pose = view->world_from_camera();
    if ((pose.translation - world_from_camera.translation).norm() > kNearShare * distance ||
        RotationAngle(pose, world_from_camera) > kNearAngle_rad) {
      continue;
    }
    order.emplace_back(ViewDistance(pose, world_from_camera, distance), view);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::shared_ptr<const PlaceView>> best;
  for (std::size_t k = 0; k < std::min(most, order.size()); ++k) best.push_back(order[k].second);
  return best;
}

}  // namespace saccade
