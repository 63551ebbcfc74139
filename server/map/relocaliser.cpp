#include "server/map/relocaliser.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace saccade {
namespace {

constexpr double kSamePlacePx = 6.0;   // corners closer than this are no rivals of each other
constexpr double kGuidedPx = 6.0;      // search radius around a predicted feature
constexpr double kGuidedSlack = 0.8;   // of max_hamming, where position does part of the work
constexpr int kVotingCorners = 250;    // strongest corners take part in the shortlist
constexpr double kMinSpreadPx = 25.0;  // standard deviation of the inliers' pixels, smaller axis
constexpr double kMinAgreement = 0.2;  // of the matches by descriptor that must be inliers
// Corners beside the features: more of them must agree, and some of the map's own as well.
constexpr FeatureId kCornerBit = FeatureId{1} << 63;
// Rooms may share things: a calendar like one of the mapped room made 13 and 18 agree in another
// room, right poses have 30 or more of the latter.
constexpr int kCornersByDescriptor = 12, kCornersGuided = 24;
constexpr int kLeastFeatures = 4;
constexpr std::size_t kCornerCandidates = 5;  // views: matching many corners takes its time

std::optional<Eigen::Vector3d> PointNow(const ViewPoint& point,
                                        const Relocaliser::PointLookup& lookup) {
  const std::optional<Eigen::Vector3d> now =
      lookup ? lookup(point.id) : std::make_optional(point.point_in_world);
  return now && now->allFinite() ? now : std::nullopt;
}

/// Smaller standard deviation of the pixels over all directions [px].
double Spread(const std::vector<Correspondence>& inliers) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Correspondence& c : inliers) mean += c.pixel;
  mean /= static_cast<double>(inliers.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Correspondence& c : inliers) {
    scatter += (c.pixel - mean) * (c.pixel - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(scatter);
  return std::sqrt(eigen.eigenvalues()[0] / static_cast<double>(inliers.size()));
}

}  // namespace

absl::Status RelocaliserOptions::Validate() const {
  if (max_views < 1 || max_points < min_inliers || max_corners < min_inliers || scene_corners < 0 ||
      candidates < 1 || !(ratio > 0 && ratio <= 1) || max_hamming < 1 || max_hamming > 255 ||
      min_inliers < 6 || !(inlier_px > 0)) {
    return absl::InvalidArgumentError(
        "map.relocaliser: max_views and candidates at least 1, max_points and max_corners at "
        "least min_inliers, scene_corners 0 or more, min_inliers at least 6, ratio in (0, 1], "
        "max_hamming 1 to 255, "
        "inlier_px above 0");
  }
  return absl::OkStatus();
}

Relocaliser::Relocaliser(const RelocaliserOptions& options) : options_(options) {}

std::vector<int> Relocaliser::Shortlist(const cv::Mat& thumbnail,
                                        const std::vector<DescribedPoint>& corners,
                                        const Scene& scene) const {
  const int count = static_cast<int>(views_.size());
  std::vector<int> order;
  for (int k = 0; k < count; ++k) {
    if (static_cast<int>(scene[k].size()) >= kLeastFeatures) order.push_back(k);
  }
  if (static_cast<int>(order.size()) <= options_.candidates) return order;
  // Votes: points whose look at the middle scale some strong corner shares.
  const std::size_t voters = std::min<std::size_t>(corners.size(), kVotingCorners);
  std::vector<double> likeness(count);
  for (const int k : order) {
    const PlaceView& view = views_[k];
    int votes = 0;
    for (const DescribedPoint& point : view.described) {
      if (!point.present[1]) continue;
      votes += std::any_of(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(voters),
                           [&](const DescribedPoint& corner) {
                             return corner.present[1] && HammingDistance(corner.descriptors[1],
                                                                         point.descriptors[1]) < 40;
                           })
                   ? 1
                   : 0;
    }
    likeness[k] = votes / std::sqrt(static_cast<double>(view.points.size())) +
                  2.0 * std::max(0.0, thumbnail.dot(view.thumbnail));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return likeness[a] > likeness[b]; });
  order.resize(options_.candidates);
  return order;
}

std::vector<Relocaliser::Known> Relocaliser::KnownFeatures(const PlaceView& view,
                                                           const PointLookup& lookup) const {
  std::vector<Known> known;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    const auto point = PointNow(view.points[k], lookup);
    if (point) known.push_back({view.points[k].id, &view.described[k], *point});
  }
  return known;
}

void Relocaliser::AppendCorners(int index, const CameraModel& camera, const PointLookup& lookup,
                                std::vector<Known>& known) const {
  const PlaceView& view = views_[index];
  if (view.corners.described.empty()) return;
  const auto pose = PoseNow(view, camera, lookup);
  if (!pose) return;
  const FeatureId first = kCornerBit | static_cast<FeatureId>(index) << 32;
  for (std::size_t k = 0; k < view.corners.described.size(); ++k) {
    const double range = view.corners.ranges_m[k];
    if (range <= 0) continue;
    known.push_back(
        {first | k, &view.corners.described[k], *pose * (range * view.corners.bearings[k])});
  }
}

std::vector<Relocaliser::Match> Relocaliser::MatchView(
    const std::vector<Known>& known, const std::vector<DescribedPoint>& corners) const {
  std::map<int, std::pair<int, Match>> by_corner;  // a corner shows one feature: the nearest
  std::vector<int> distances(corners.size());
  // Beyond it nothing is near enough, nor a rival of what is.
  const int beyond = static_cast<int>(options_.max_hamming / options_.ratio) + 1;
  for (const Known& one : known) {
    for (std::size_t c = 0; c < corners.size(); ++c) {
      distances[c] = PointDistance(*one.look, corners[c], beyond);
    }
    const auto best = std::min_element(distances.begin(), distances.end());
    if (best == distances.end() || *best > options_.max_hamming) continue;
    const int corner = static_cast<int>(best - distances.begin());
    int second = 256;
    for (std::size_t c = 0; c < corners.size(); ++c) {
      if (distances[c] >= second) continue;
      if ((corners[c].pixel - corners[corner].pixel).norm() > kSamePlacePx) second = distances[c];
    }
    if (*best > options_.ratio * second) continue;
    const Match match{one.id, corner, one.point_in_world};
    const auto [at, fresh] = by_corner.try_emplace(corner, *best, match);
    if (!fresh && *best < at->second.first) at->second = {*best, match};
  }
  std::vector<Match> matches;
  for (const auto& [corner, match] : by_corner) matches.push_back(match.second);
  return matches;
}

std::vector<Relocaliser::Match> Relocaliser::MatchGuided(const Rigid3& world_from_camera,
                                                         const CameraModel& camera,
                                                         const std::vector<DescribedPoint>& corners,
                                                         const Scene& scene) const {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  std::map<FeatureId, std::pair<int, Match>> by_feature;
  const int limit = static_cast<int>(kGuidedSlack * options_.max_hamming);
  for (const std::vector<Known>& view : scene) {
    for (const Known& one : view) {
      const auto predicted = camera.Project(camera_from_world * one.point_in_world);
      if (!predicted || !camera.InImage(*predicted)) continue;
      for (std::size_t c = 0; c < corners.size(); ++c) {
        if ((corners[c].pixel - *predicted).squaredNorm() > kGuidedPx * kGuidedPx) continue;
        const int distance = PointDistance(*one.look, corners[c]);
        if (distance > limit) continue;
        const Match match{one.id, static_cast<int>(c), one.point_in_world};
        const auto [at, fresh] = by_feature.try_emplace(match.id, distance, match);
        if (!fresh && distance < at->second.first) at->second = {distance, match};
      }
    }
  }
  std::vector<Match> matches;
  std::set<int> taken;  // features come before corners
  for (const auto& [id, match] : by_feature) {
    if (taken.insert(match.second.corner).second) matches.push_back(match.second);
  }
  return matches;
}

std::optional<Relocalisation> Relocaliser::Confirm(const std::vector<Match>& matches, FrameId view,
                                                   const CameraModel& camera,
                                                   const std::vector<DescribedPoint>& corners,
                                                   const Scene& scene, const Bar& bar) const {
  const auto solve = [&](const std::vector<Match>& used, int least) {
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector2d> pixels;
    for (const Match& match : used) {
      points.push_back(match.point_in_world);
      pixels.push_back(corners[match.corner].pixel);
    }
    return FitPoseRansac(
        camera, points, pixels,
        {.inlier_px = options_.inlier_px, .min_inliers = least, .seed = options_.seed});
  };
  // By descriptor alone: this, and not what a pose then finds around its own predictions, is the
  // evidence that the place is the right one.
  const auto first = solve(matches, bar.by_descriptor);
  if (!first.ok() || static_cast<double>(first->inliers.size()) <
                         kMinAgreement * static_cast<double>(matches.size())) {
    return std::nullopt;
  }
  const std::vector<Match> guided =
      MatchGuided(first->fit.world_from_camera, camera, corners, scene);
  const auto second = solve(guided, bar.guided);
  if (!second.ok() || 3 * second->inliers.size() < guided.size()) return std::nullopt;

  Relocalisation found;
  found.world_from_camera = second->fit.world_from_camera;
  found.pose_covariance = second->fit.covariance;
  found.view = view;
  double squared = 0;
  std::vector<Correspondence> seen_again;
  for (const int k : second->inliers) {
    const Match& match = guided[k];
    const Correspondence c{match.id, corners[match.corner].pixel, match.point_in_world};
    const auto seen = camera.Project(found.world_from_camera.Inverse() * c.point_in_world);
    squared += (*seen - c.pixel).squaredNorm();
    seen_again.push_back(c);
    if ((match.id & kCornerBit) == 0) found.inliers.push_back(c);
  }
  found.rms_px = std::sqrt(squared / static_cast<double>(seen_again.size()));
  const double spread = kMinSpreadPx * camera.width() / 640.0;
  if (Spread(seen_again) < spread) return std::nullopt;  // too small a part of the picture
  if (static_cast<int>(found.inliers.size()) < kLeastFeatures) return std::nullopt;
  return found;
}

std::optional<Relocalisation> Relocaliser::Query(const cv::Mat& grey, const CameraModel& camera,
                                                 const PointLookup& lookup) const {
  if (views_.empty() || grey.type() != CV_8UC1 || grey.cols != camera.width() ||
      grey.rows != camera.height()) {
    return std::nullopt;
  }
  const std::vector<Eigen::Vector2d> pixels = PlacesToDescribe(grey, options_.max_corners);
  if (static_cast<int>(pixels.size()) < options_.min_inliers) return std::nullopt;
  const std::vector<DescribedPoint> corners = DescribePixels(grey, pixels);
  Scene scene;
  for (const PlaceView& view : views_) scene.push_back(KnownFeatures(view, lookup));
  std::vector<int> candidates = Shortlist(Thumbnail(grey), corners, scene);
  if (candidates.empty()) return std::nullopt;
  auto found = TryCandidates(candidates, scene, camera, corners,
                             {std::max(6, 2 * options_.min_inliers / 3), options_.min_inliers});
  if (found) return found;
  candidates.resize(std::min(candidates.size(), kCornerCandidates));
  std::size_t features = 0, all = 0;
  for (const int k : candidates) {
    features += scene[k].size();
    AppendCorners(k, camera, lookup, scene[k]);
    all += scene[k].size();
  }
  if (all == features) return std::nullopt;
  return TryCandidates(candidates, scene, camera, corners, {kCornersByDescriptor, kCornersGuided});
}

std::optional<Relocalisation> Relocaliser::TryCandidates(const std::vector<int>& candidates,
                                                         const Scene& scene,
                                                         const CameraModel& camera,
                                                         const std::vector<DescribedPoint>& corners,
                                                         const Bar& bar) const {
  std::vector<Match> pooled;
  std::set<int> taken;
  for (const int k : candidates) {
    const std::vector<Match> matches = MatchView(scene[k], corners);
    auto found = Confirm(matches, views_[k].frame, camera, corners, scene, bar);
    if (found) return found;
    for (const Match& match : matches) {
      if (taken.insert(match.corner).second) pooled.push_back(match);
    }
  }
  // A view between views may have a few features of each.
  if (candidates.size() < 2) return std::nullopt;
  return Confirm(pooled, views_[candidates.front()].frame, camera, corners, scene, bar);
}

}  // namespace saccade
