#include "server/tracker/loop_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr int kMostLooked = 80, kFewestExpected = 15, kFewestAgreed = 12;
constexpr double kShareFound = 0.5, kShareAgreed = 0.75;
constexpr double kSearchSigma_px = 4.0, kInlier_px = 2.0, kApart_px = 10.0, kBorder_px = 20.0;
constexpr double kMostAside_rad = 0.7, kMostScale = 1.8;
constexpr double kSpread_px = 25.0;    // at 640 pixels; as the relocaliser
constexpr double kOffPlane = 0.015;    // of the distance, rms
constexpr double kSamePoint_px = 2.5;  // an old and a present landmark on one corner
constexpr double kLoopDepthKnown = 0.1;
constexpr double kAgreeAngle_rad = 0.02, kAgreeShare = 0.03;  // between sights
constexpr std::size_t kFewestScales = 6;
// Log sigma of scale where nothing tells, and where points do: the seam must fit, whatever the way
// round has to give for it; left with 6 % between them the two sides never became one map.
constexpr double kUnknownScale = 0.1, kMeasuredScale = 0.002;

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Expected {
  std::size_t index;  // into the old landmarks
  Eigen::Vector2d pixel;
  Eigen::Vector3d point;  // [m, old world]
  std::uint32_t matched;
};

/// Those that should be seen, best known first, none on top of another.
std::vector<Expected> ShouldBeSeen(const OldLandmarks& old, const Rigid3& pose,
                                   const CameraModel& camera) {
  std::vector<Expected> all;
  const Rigid3 camera_from_old = pose.Inverse();
  for (std::size_t k = 0; k < old.size(); ++k) {
    const KeyframeGraph::Recalled& known = old[k].second;
    const double range = 1.0 / known.estimate.inverse_range;
    const Eigen::Vector3d ray = known.world_from_anchor.rotation * known.estimate.bearing;
    const Eigen::Vector3d point = known.PointInWorld();
    const Eigen::Vector3d seen = camera_from_old * point;
    const double distance = seen.norm();
    if (seen.z() < 0.2 * distance || distance * kMostScale < range ||
        distance > kMostScale * range ||
        ray.dot(point - pose.translation) < std::cos(kMostAside_rad) * distance) {
      continue;
    }
    const auto pixel = camera.Project(seen);
    if (!pixel || !camera.InImage(*pixel, kBorder_px)) continue;
    all.push_back({k, *pixel, point, old[k].first->landmark.matched});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Expected& a, const Expected& b) { return a.matched > b.matched; });
  std::vector<Expected> chosen;
  for (const Expected& one : all) {
    if (std::ssize(chosen) >= kMostLooked) break;
    const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const Expected& other) {
      return (other.pixel - one.pixel).squaredNorm() < kApart_px * kApart_px;
    });
    if (!near) chosen.push_back(one);
  }
  return chosen;
}

/// Smaller standard deviation over all directions, of any number of coordinates.
template <int N>
double LeastSpread(const std::vector<Eigen::Matrix<double, N, 1>>& points) {
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  for (const auto& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix<double, N, N> scatter = Eigen::Matrix<double, N, N>::Zero();
  for (const auto& point : points) scatter += (point - mean) * (point - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(scatter);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[0]) / static_cast<double>(points.size()));
}

/// Range of the present landmark that was matched at this pixel; 0: there is none.
double PresentRange(const Eigen::Vector2d& pixel, const FilterState& filter,
                    const FrameMatches& matches) {
  for (const LandmarkMatch& match : matches.in_view) {
    if (!match.accepted() || (match.pixel - pixel).norm() > kSamePoint_px) continue;
    if (!filter.Has(match.id)) continue;
    const FeatureMarginal marginal = filter.Marginal(match.id);
    if (marginal.inverse_range_sigma > kLoopDepthKnown * marginal.inverse_range) continue;
    return (marginal.point_in_world - filter.camera().world_from_camera.translation).norm();
  }
  return 0.0;
}

struct Found {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<KeyframeId> anchors;
  int expected = 0;
};

Found Search(const OldLandmarks& old, const Rigid3& pose, const ImagePyramid& pyramid,
             const CameraModel& camera) {
  SearchOptions options;
  options.sub_pixel = SubPixel::kParabola;
  PatchSearcher searcher(options);
  const Eigen::Matrix2d spread = kSearchSigma_px * kSearchSigma_px * Eigen::Matrix2d::Identity();
  Found found;
  WarpedPatch look;
  for (const Expected& one : ShouldBeSeen(old, pose, camera)) {
    const auto& [dormant, known] = old[one.index];
    if (WarpPatch(dormant->landmark.patch, pose.Inverse() * known.world_from_anchor,
                  known.estimate.bearing, known.estimate.inverse_range, Eigen::Vector3d::Zero(),
                  camera, one.pixel, WarpOptions(), look) != WarpStatus::kOk) {
      continue;
    }
    ++found.expected;
    const SearchResult result = searcher.Find(pyramid, look, one.pixel, spread);
    if (!result.found()) continue;
    found.points.push_back(one.point);
    found.pixels.push_back(result.pixel);
    found.anchors.push_back(known.anchor);
  }
  return found;
}

}  // namespace

std::optional<LoopSight> LookForOld(const OldLandmarks& old, const Rigid3& expected_pose,
                                    const ImagePyramid& pyramid, const CameraModel& camera,
                                    const FilterState& filter, const FrameMatches& matches) {
  const Found found = Search(old, expected_pose, pyramid, camera);
  const auto count = static_cast<double>(found.points.size());
  if (found.expected < kFewestExpected || count < kShareFound * found.expected) {
    return std::nullopt;
  }
  const auto pose = FitPoseRansac(camera, found.points, found.pixels,
                                  {.inlier_px = kInlier_px, .min_inliers = kFewestAgreed});
  if (!pose.ok() || static_cast<double>(pose->inliers.size()) < kShareAgreed * count) {
    return std::nullopt;
  }
  LoopSight sight;
  sight.old_from_camera = pose->fit.world_from_camera;
  sight.present_from_camera = filter.camera().world_from_camera;
  sight.expected = found.expected;
  sight.found = static_cast<int>(found.points.size());
  sight.agreed = static_cast<int>(pose->inliers.size());
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> ranges;
  for (const int k : pose->inliers) {
    points.push_back(found.points[k]);
    pixels.push_back(found.pixels[k]);
    ranges.push_back((found.points[k] - sight.old_from_camera.translation).norm());
    sight.anchors.push_back(found.anchors[k]);
    const double present = PresentRange(found.pixels[k], filter, matches);
    if (present > 0.0) sight.scales.push_back(ranges.back() / present);
  }
  sight.distance_m = Median(ranges);
  if (LeastSpread<2>(pixels) < kSpread_px * camera.width() / 640.0 ||
      LeastSpread<3>(points) < kOffPlane * sight.distance_m) {
    return std::nullopt;
  }
  return sight;
}

std::optional<LoopAgreement> Agree(std::span<const LoopSight> sights) {
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  std::vector<double> scales;
  const auto turn = [](const LoopSight& sight) {
    return (sight.old_from_camera.rotation * sight.present_from_camera.rotation.conjugate())
        .normalized();
  };
  for (const LoopSight& sight : sights) {
    const Eigen::Vector4d q = turn(sight).coeffs();
    mean += q.dot(turn(sights.front()).coeffs()) < 0 ? -q : q;
    scales.insert(scales.end(), sight.scales.begin(), sight.scales.end());
  }
  LoopAgreement agreement;
  Similarity3& found = agreement.old_from_present;
  found.rotation = Eigen::Quaterniond(mean.normalized());
  agreement.log_scale_sigma = kUnknownScale;
  if (scales.size() >= kFewestScales) {
    found.scale = Median(scales);
    agreement.log_scale_sigma = kMeasuredScale;
  }
  for (const LoopSight& sight : sights) {
    found.translation += (sight.old_from_camera.translation -
                          found.scale * (found.rotation * sight.present_from_camera.translation)) /
                         static_cast<double>(sights.size());
  }
  for (const LoopSight& sight : sights) {
    const Rigid3 there = found.Move(sight.present_from_camera);
    if ((there.translation - sight.old_from_camera.translation).norm() >
            kAgreeShare * sight.distance_m ||
        RotationAngle(there, sight.old_from_camera) > kAgreeAngle_rad) {
      return std::nullopt;
    }
  }
  return agreement;
}

}  // namespace saccade
