#include "server/map/relocaliser.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "server/features/corner_detector.hpp"

namespace saccade {
namespace {

constexpr int kBorderPx = 20;
constexpr double kSamePlacePx = 6.0;   // corners closer than this are no rivals of each other
constexpr double kGuidedPx = 6.0;      // search radius around a predicted feature
constexpr double kGuidedSlack = 0.8;   // of max_hamming, where position does part of the work
constexpr int kVotingCorners = 250;    // strongest corners take part in the shortlist
constexpr double kMinSpreadPx = 25.0;  // standard deviation of the inliers' pixels, smaller axis
constexpr double kMinAgreement = 0.2;  // of the matches by descriptor that must be inliers

/// Corners of the queried picture: denser than a tracker wants, so that features repeat.
std::vector<Eigen::Vector2d> QueryCorners(const cv::Mat& grey, int count) {
  ImagePyramid pyramid;
  if (!pyramid.Build(grey).ok()) return {};
  CornerDetector detector(
      {.min_score = 500.0, .border_px = kBorderPx, .cell_px = 12, .min_distance_px = 6.0});
  std::vector<Corner> corners;
  detector.DetectAll(pyramid, {}, count, corners);
  std::vector<Eigen::Vector2d> pixels;
  for (const Corner& corner : corners) pixels.push_back(corner.pixel);
  return pixels;
}

std::optional<Eigen::Vector3d> PointNow(const KeyframePoint& point,
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

/// Metres and radians into one number: 0.2 m count as much as 15 degrees.
double ViewDistance(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm() / 0.2 + RotationAngle(a, b) / 0.26;
}

}  // namespace

absl::Status RelocaliserOptions::Validate() const {
  if (max_keyframes < 1 || max_points < min_inliers || max_corners < min_inliers ||
      candidates < 1 || !(ratio > 0 && ratio <= 1) || max_hamming < 1 || max_hamming > 255 ||
      min_inliers < 6 || !(inlier_px > 0)) {
    return absl::InvalidArgumentError(
        "map.relocaliser: max_keyframes and candidates at least 1, max_points and max_corners at "
        "least min_inliers, min_inliers at least 6, ratio in (0, 1], max_hamming 1 to 255, "
        "inlier_px above 0");
  }
  return absl::OkStatus();
}

Relocaliser::Relocaliser(const RelocaliserOptions& options) : options_(options) {}

absl::Status Relocaliser::AddKeyframe(FrameId frame, const cv::Mat& grey,
                                      const Rigid3& world_from_camera,
                                      std::span<const KeyframePoint> points) {
  if (grey.type() != CV_8UC1 || grey.cols < 64 || grey.rows < 64) {
    return absl::InvalidArgumentError("keyframe: needs an 8-bit grey picture of 64 x 64 or more");
  }
  Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.world_from_camera = world_from_camera;
  const cv::Rect2d inside(kBorderPx, kBorderPx, grey.cols - 2 * kBorderPx,
                          grey.rows - 2 * kBorderPx);
  std::vector<Eigen::Vector2d> pixels;
  for (const KeyframePoint& point : points) {
    if (static_cast<int>(keyframe.points.size()) == options_.max_points) break;
    if (!point.pixel.allFinite() || !point.point_in_world.allFinite() ||
        !inside.contains({point.pixel.x(), point.pixel.y()})) {
      continue;
    }
    keyframe.points.push_back(point);
    pixels.push_back(point.pixel);
  }
  if (static_cast<int>(pixels.size()) < options_.min_inliers) {
    return absl::InvalidArgumentError(absl::StrCat("keyframe ", frame, ": ", pixels.size(),
                                                   " usable points, ", options_.min_inliers,
                                                   " needed"));
  }
  keyframe.thumbnail = Thumbnail(grey);
  keyframe.described = DescribePixels(grey, pixels);
  keyframes_.push_back(std::move(keyframe));
  if (static_cast<int>(keyframes_.size()) > options_.max_keyframes) DropMostRedundant();
  return absl::OkStatus();
}

void Relocaliser::DropMostRedundant() {
  // The older of the two most alike; the newest stays, its points are the freshest.
  std::size_t drop = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t a = 0; a < keyframes_.size(); ++a) {
    for (std::size_t b = a + 1; b < keyframes_.size(); ++b) {
      const double distance =
          ViewDistance(keyframes_[a].world_from_camera, keyframes_[b].world_from_camera);
      if (distance < least) {
        least = distance;
        drop = a;
      }
    }
  }
  keyframes_.erase(keyframes_.begin() + static_cast<std::ptrdiff_t>(drop));
}

bool Relocaliser::NeedsKeyframe(const Rigid3& world_from_camera, double min_distance_m,
                                double min_angle_rad) const {
  return std::none_of(keyframes_.begin(), keyframes_.end(), [&](const Keyframe& k) {
    return (k.world_from_camera.translation - world_from_camera.translation).norm() <
               min_distance_m &&
           RotationAngle(k.world_from_camera, world_from_camera) < min_angle_rad;
  });
}

std::vector<int> Relocaliser::Shortlist(const cv::Mat& thumbnail,
                                        const std::vector<DescribedPoint>& corners) const {
  const int count = static_cast<int>(keyframes_.size());
  std::vector<int> order(count);
  for (int k = 0; k < count; ++k) order[k] = k;
  if (count <= options_.candidates) return order;
  // Votes: points whose look at the middle scale some strong corner shares.
  const std::size_t voters = std::min<std::size_t>(corners.size(), kVotingCorners);
  std::vector<double> likeness(count);
  for (int k = 0; k < count; ++k) {
    const Keyframe& keyframe = keyframes_[k];
    int votes = 0;
    for (const DescribedPoint& point : keyframe.described) {
      if (!point.present[1]) continue;
      votes += std::any_of(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(voters),
                           [&](const DescribedPoint& corner) {
                             return corner.present[1] && HammingDistance(corner.descriptors[1],
                                                                         point.descriptors[1]) < 40;
                           })
                   ? 1
                   : 0;
    }
    likeness[k] = votes / std::sqrt(static_cast<double>(keyframe.points.size())) +
                  2.0 * std::max(0.0, thumbnail.dot(keyframe.thumbnail));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return likeness[a] > likeness[b]; });
  order.resize(options_.candidates);
  return order;
}

std::vector<Relocaliser::Match> Relocaliser::MatchKeyframe(
    const Keyframe& keyframe, const std::vector<DescribedPoint>& corners,
    const PointLookup& lookup) const {
  std::map<int, std::pair<int, Match>> by_corner;  // a corner shows one feature: the nearest
  std::vector<int> distances(corners.size());
  for (std::size_t k = 0; k < keyframe.points.size(); ++k) {
    const auto point = PointNow(keyframe.points[k], lookup);
    if (!point) continue;
    for (std::size_t c = 0; c < corners.size(); ++c) {
      distances[c] = PointDistance(keyframe.described[k], corners[c]);
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
    const auto [at, fresh] =
        by_corner.try_emplace(corner, *best, Match{keyframe.points[k].id, corner, *point});
    if (!fresh && *best < at->second.first) {
      at->second = {*best, Match{keyframe.points[k].id, corner, *point}};
    }
  }
  std::vector<Match> matches;
  for (const auto& [corner, match] : by_corner) matches.push_back(match.second);
  return matches;
}

std::vector<Relocaliser::Match> Relocaliser::MatchGuided(const Rigid3& world_from_camera,
                                                         const CameraModel& camera,
                                                         const std::vector<DescribedPoint>& corners,
                                                         const PointLookup& lookup) const {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  std::map<FeatureId, std::pair<int, Match>> by_feature;
  const int limit = static_cast<int>(kGuidedSlack * options_.max_hamming);
  for (const Keyframe& keyframe : keyframes_) {
    for (std::size_t k = 0; k < keyframe.points.size(); ++k) {
      const auto point = PointNow(keyframe.points[k], lookup);
      if (!point) continue;
      const auto predicted = camera.Project(camera_from_world * *point);
      if (!predicted || !camera.InImage(*predicted)) continue;
      for (std::size_t c = 0; c < corners.size(); ++c) {
        if ((corners[c].pixel - *predicted).squaredNorm() > kGuidedPx * kGuidedPx) continue;
        const int distance = PointDistance(keyframe.described[k], corners[c]);
        if (distance > limit) continue;
        const Match match{keyframe.points[k].id, static_cast<int>(c), *point};
        const auto [at, fresh] = by_feature.try_emplace(match.id, distance, match);
        if (!fresh && distance < at->second.first) at->second = {distance, match};
      }
    }
  }
  std::vector<Match> matches;
  std::set<int> taken;
  for (const auto& [id, match] : by_feature) {
    if (taken.insert(match.second.corner).second) matches.push_back(match.second);
  }
  return matches;
}

std::optional<Relocalisation> Relocaliser::Confirm(const std::vector<Match>& matches,
                                                   FrameId keyframe, const CameraModel& camera,
                                                   const std::vector<DescribedPoint>& corners,
                                                   const PointLookup& lookup) const {
  const auto solve = [&](const std::vector<Match>& used, int min_inliers) {
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector2d> pixels;
    for (const Match& match : used) {
      points.push_back(match.point_in_world);
      pixels.push_back(corners[match.corner].pixel);
    }
    return FitPoseRansac(
        camera, points, pixels,
        {.inlier_px = options_.inlier_px, .min_inliers = min_inliers, .seed = options_.seed});
  };
  // By descriptor alone: this, and not what a pose then finds around its own predictions, is the
  // evidence that the place is the right one.
  const int unguided = std::max(6, 2 * options_.min_inliers / 3);
  const auto first = solve(matches, unguided);
  if (!first.ok() || static_cast<double>(first->inliers.size()) <
                         kMinAgreement * static_cast<double>(matches.size())) {
    return std::nullopt;
  }
  const std::vector<Match> guided =
      MatchGuided(first->fit.world_from_camera, camera, corners, lookup);
  const auto second = solve(guided, options_.min_inliers);
  if (!second.ok() || 3 * second->inliers.size() < guided.size()) return std::nullopt;

  Relocalisation found;
  found.world_from_camera = second->fit.world_from_camera;
  found.pose_covariance = second->fit.covariance;
  found.keyframe = keyframe;
  double squared = 0;
  for (const int k : second->inliers) {
    const Match& match = guided[k];
    const Correspondence c{match.id, corners[match.corner].pixel, match.point_in_world};
    const auto seen = camera.Project(found.world_from_camera.Inverse() * c.point_in_world);
    squared += (*seen - c.pixel).squaredNorm();
    found.inliers.push_back(c);
  }
  found.rms_px = std::sqrt(squared / static_cast<double>(found.inliers.size()));
  const double spread = kMinSpreadPx * camera.width() / 640.0;
  if (Spread(found.inliers) < spread) return std::nullopt;  // too small a part of the picture
  return found;
}

std::optional<Relocalisation> Relocaliser::Query(const cv::Mat& grey, const CameraModel& camera,
                                                 const PointLookup& lookup) const {
  if (keyframes_.empty() || grey.type() != CV_8UC1 || grey.cols != camera.width() ||
      grey.rows != camera.height()) {
    return std::nullopt;
  }
  const std::vector<Eigen::Vector2d> pixels = QueryCorners(grey, options_.max_corners);
  if (static_cast<int>(pixels.size()) < options_.min_inliers) return std::nullopt;
  const std::vector<DescribedPoint> corners = DescribePixels(grey, pixels);
  const std::vector<int> candidates = Shortlist(Thumbnail(grey), corners);
  std::vector<Match> pooled;
  std::set<int> taken;
  for (const int k : candidates) {
    const std::vector<Match> matches = MatchKeyframe(keyframes_[k], corners, lookup);
    auto found = Confirm(matches, keyframes_[k].frame, camera, corners, lookup);
    if (found) return found;
    for (const Match& match : matches) {
      if (taken.insert(match.corner).second) pooled.push_back(match);
    }
  }
  // A view between keyframes may have a few features of each.
  if (candidates.size() < 2) return std::nullopt;
  return Confirm(pooled, keyframes_[candidates.front()].frame, camera, corners, lookup);
}

}  // namespace saccade
