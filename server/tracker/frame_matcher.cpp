#include "server/tracker/frame_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "server/tracker/group_consistency.hpp"
#include "server/tracker/line_time.hpp"

namespace saccade {
namespace {

constexpr double kBorder_px = 6.0;       // half a patch: nearer to the edge nothing can be compared
constexpr int kFewestForMotion = 6;      // matches: fewer may agree on any
constexpr double kUncertain_rad = 0.03;  // of the camera's direction, before a frame is searched

/// Pose, direction and inverse range from where the landmark's patch was seen.
PointFromClone FromBirth(const Landmark& landmark,
                         const std::variant<PointFromClone, Eigen::Vector3d>& point) {
  if (std::holds_alternative<PointFromClone>(point)) return std::get<PointFromClone>(point);
  PointFromClone from;
  from.world_from_clone = landmark.known->world_from_birth;
  const Eigen::Vector3d seen =
      landmark.known->world_from_birth.Inverse() * std::get<Eigen::Vector3d>(point);
  from.bearing = seen.normalized();
  from.inverse_range = 1.0 / seen.norm();
  return from;
}

/// A target is where it is said to be. If most of its points that were found are refused at once,
/// the young map around them has agreed on a wrong pose (4 of 12 starts of the points simulation):
/// then they keep a say.
void HeedTarget(std::span<LandmarkMatch* const> found) {
  constexpr double kSay = 0.5;
  constexpr int kFewest = 4;  // fewer may well be false together
  const auto known = [](const LandmarkMatch* match) {
    return std::holds_alternative<Eigen::Vector3d>(match->point);
  };
  int total = 0, refused = 0;
  for (const LandmarkMatch* match : found) {
    total += known(match) ? 1 : 0;
    refused += known(match) && !match->accepted() ? 1 : 0;
  }
  if (total < kFewest || 2 * refused <= total) return;
  for (LandmarkMatch* match : found) {
    if (known(match)) match->weight = std::max(match->weight, kSay);
  }
}

/// Where a blind camera looks again, gates are wide: matches that contradict the others of their
/// clone are dropped. Only of features whose depth is known; the others' residuals tell nothing.
void HeedGroups(const CameraModel& camera, const FilterState& filter, const LandmarkMap& map,
                const Matrix6d& prior, FrameMatches& matches) {
  constexpr std::uint32_t kMature = 15;  // matches
  constexpr double kDepthKnown = 0.05;   // sigma / inverse range
  constexpr std::size_t kFewest = 12;
  std::map<CloneId, int> group_of;
  std::vector<GroupResidual> residuals;
  std::vector<LandmarkMatch*> judged;
  for (LandmarkMatch& match : matches.in_view) {
    if (!match.accepted() || !filter.Has(match.id) || map.Find(match.id)->matched < kMature) {
      continue;
    }
    const FeatureMarginal marginal = filter.Marginal(match.id);
    if (marginal.inverse_range_sigma > kDepthKnown * marginal.inverse_range) continue;
    const auto at =
        PredictFromClone(camera, matches.pose.world_from_camera, filter.Point(match.id));
    if (!at) continue;
    const int next = static_cast<int>(group_of.size());
    const int group = group_of.emplace(filter.CloneOf(match.id), next).first->second;
    residuals.push_back({group, match.pixel - match.row_shift - at->pixel, at->d_camera,
                         at->d_clone.rightCols<3>()});
    judged.push_back(&match);
  }
  if (judged.size() < kFewest) return;
  const std::vector<bool> agrees =
      AgreeTogether(residuals, prior.diagonal().cwiseMax(0.0).cwiseSqrt());
  for (std::size_t k = 0; k < judged.size(); ++k) {
    if (!agrees[k]) judged[k]->weight = 0.0;
  }
}

/// Rows are exposed one after the other: what is seen in one of them is seen `late` read-outs after
/// mid-exposure, from a camera that has moved on with the present velocities.
void BookRow(const CameraModel& camera, const CameraMotion& motion, double readout_s,
             const Eigen::Vector2d& pixel, LandmarkMatch& match) {
  Eigen::Matrix<double, 6, 1> velocities;
  velocities << motion.velocity_m_s, motion.angular_velocity_rad_s;
  match.d_readout = match.predicted.at.d_camera * velocities * LateInReadouts(camera, pixel);
  match.row_shift = match.d_readout * readout_s;
}

}  // namespace

double FrameMatcher::PixelSigma(const CameraModel& camera, const Eigen::Vector2d& pixel) const {
  const CameraIntrinsics& lens = camera.intrinsics();
  const Eigen::Vector2d centre(lens.cx, lens.cy);
  const double farthest = 0.5 * std::hypot(lens.width, lens.height);
  const double share = std::min(1.5, (pixel - centre).norm() / farthest);
  return options_.pixel_sigma_px * (1.0 + options_.pixel_sigma_growth * share);
}

std::vector<LandmarkMatch> FrameMatcher::Visible(const CameraModel& camera,
                                                 const FilterState& filter,
                                                 const LandmarkMap& map) const {
  std::vector<LandmarkMatch> in_view;
  in_view.reserve(map.all().size());
  for (const Landmark& landmark : map.all()) {
    const auto predicted = landmark.known ? filter.Predicted(camera, landmark.known->point_in_world)
                                          : filter.Predicted(camera, landmark.id);
    if (!predicted || !camera.InImage(predicted->at.pixel, kBorder_px)) continue;
    LandmarkMatch match;
    match.id = landmark.id;
    match.waits = landmark.waits;
    match.predicted = *predicted;
    if (landmark.known) {
      match.point = landmark.known->point_in_world;
    } else {
      match.point = filter.Point(landmark.id);
    }
    match.pixel = predicted->at.pixel;
    in_view.push_back(std::move(match));
  }
  return in_view;
}

std::vector<int> FrameMatcher::Order(const CameraModel& camera,
                                     const std::vector<LandmarkMatch>& in_view,
                                     const LandmarkMap& map, std::mt19937_64& random) const {
  constexpr int kColumns = 6, kRows = 5;
  struct Entry {
    double worth;
    int index;
  };
  std::array<std::vector<Entry>, kColumns * kRows> cells;
  for (std::size_t k = 0; k < in_view.size(); ++k) {
    if (in_view[k].waits) continue;
    const Landmark& landmark = *map.Find(in_view[k].id);
    // Old and reliable first; a little chance, so that equals take turns.
    const double age = std::min<double>(landmark.matched, 100.0);
    const double worth = landmark.recent * (landmark.known ? 200.0 : 10.0 + age) *
                         (0.8 + 0.4 * static_cast<double>(random() % 1000) / 1000.0);
    const Eigen::Vector2d& at = in_view[k].pixel;
    const int column =
        std::clamp(static_cast<int>(at.x() * kColumns / camera.width()), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(at.y() * kRows / camera.height()), 0, kRows - 1);
    cells[row * kColumns + column].push_back({worth, static_cast<int>(k)});
  }
  std::vector<std::pair<int, Entry>> ranked;  // rank within the cell
  for (std::vector<Entry>& cell : cells) {
    std::sort(cell.begin(), cell.end(), [](const Entry& a, const Entry& b) {
      return a.worth != b.worth ? a.worth > b.worth : a.index < b.index;
    });
    for (std::size_t k = 0; k < cell.size(); ++k) ranked.emplace_back(static_cast<int>(k), cell[k]);
  }
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    if (a.second.worth != b.second.worth) return a.second.worth > b.second.worth;
    return a.second.index < b.second.index;
  });
  std::vector<int> order;
  for (const auto& [rank, entry] : ranked) order.push_back(entry.index);
  return order;
}

void FrameMatcher::Search(FrontEnd& front_end, const CameraModel& camera, const LandmarkMap& map,
                          const PosePrior& prior, const Rigid3& pose,
                          const Matrix6d& pose_covariance, const CameraMotion& motion,
                          double readout_s, LandmarkMatch& match) const {
  const Landmark& landmark = *map.Find(match.id);
  const Eigen::LLT<Matrix6d> factor(prior.covariance);
  const auto expected = PixelGivenPose(camera, prior, factor, match.point, match.predicted, pose);
  match.found = match.hidden = false;
  match.weight = 0.0;
  if (!expected || !camera.InImage(expected->pixel, kBorder_px)) return;
  BookRow(camera, motion, readout_s, expected->pixel, match);
  match.pixel = expected->pixel + match.row_shift;
  const double sigma = PixelSigma(camera, expected->pixel);
  const Eigen::Matrix2d spread = expected->d_pose * pose_covariance * expected->d_pose.transpose() +
                                 expected->covariance + sigma * sigma * Eigen::Matrix2d::Identity();
  const LandmarkSighting sighting =
      front_end.Find({&landmark, FromBirth(landmark, match.point), pose, match.pixel, spread});
  if (sighting.kind == LandmarkSighting::Kind::kNotSought) return;
  match.searched_px2 += sighting.searched_px2;
  match.found = sighting.kind == LandmarkSighting::Kind::kFound;
  match.hidden = sighting.kind == LandmarkSighting::Kind::kHidden;
  match.searched = !match.hidden;
  if (!match.found) return;
  match.pixel = sighting.pixel;
  BookRow(camera, motion, readout_s, sighting.pixel, match);
  match.noise = sigma * sigma * Eigen::Matrix2d::Identity() + sighting.covariance;
}

RobustPose FrameMatcher::Solve(const CameraModel& camera, const PosePrior& prior,
                               std::vector<LandmarkMatch>& in_view, std::mt19937_64& random) const {
  std::vector<PoseEvidence> evidence;
  std::vector<LandmarkMatch*> used;
  for (LandmarkMatch& match : in_view) {
    if (!match.found) continue;
    evidence.push_back({match.point, match.predicted, match.pixel - match.row_shift, match.noise});
    used.push_back(&match);
  }
  RobustPoseOptions robust;
  robust.cutoff = options_.robust_cutoff;
  RobustPose pose = EstimateRobustPose(camera, prior, evidence, robust, random);
  for (std::size_t k = 0; k < used.size(); ++k) {
    used[k]->weight = options_.robust ? pose.weights[k] : 1.0;
  }
  HeedTarget(used);
  return pose;
}

void FrameMatcher::Renew(const CameraModel& camera, const FilterState& filter,
                         FrameMatches& matches, std::mt19937_64& random) const {
  const PosePrior prior{filter.camera().world_from_camera, filter.PoseCovariance()};
  matches.motion = filter.WholeMotion();
  std::erase_if(matches.in_view, [&](LandmarkMatch& match) {
    const auto predicted = filter.Predicted(camera, match.id);
    if (!predicted) return true;
    match.predicted = *predicted;
    match.point = filter.Point(match.id);
    match.row_shift = match.d_readout * filter.readout_s();
    match.found = match.accepted();
    return false;
  });
  matches.pose = Solve(camera, prior, matches.in_view, random);
  matches.attempted = matches.accepted = 0;
  for (const LandmarkMatch& match : matches.in_view) {
    matches.attempted += match.searched ? 1 : 0;
    matches.accepted += match.accepted() ? 1 : 0;
  }
}

void FrameMatcher::CatchUp(const CameraModel& camera, const FilterState& filter,
                           const MotionStep& step, FrameMatches& matches) {
  if (matches.pose.inliers < kFewestForMotion) return;
  matches.motion = PresentMotion(filter, matches.pose.world_from_camera, step);
  for (LandmarkMatch& match : matches.in_view) {
    if (match.found) BookRow(camera, matches.motion, filter.readout_s(), match.pixel, match);
  }
}

FrameMatches FrameMatcher::Match(FrontEnd& front_end, const CameraModel& camera,
                                 const FilterState& filter, const LandmarkMap& map,
                                 const MotionStep& step, std::mt19937_64& random) const {
  FrameMatches matches;
  const PosePrior prior{filter.camera().world_from_camera, filter.PoseCovariance()};
  matches.motion = filter.WholeMotion();
  matches.in_view = Visible(camera, filter, map);
  std::vector<LandmarkMatch>& in_view = matches.in_view;
  const std::vector<int> order = Order(camera, in_view, map, random);
  const int total = std::min<int>(options_.measured_per_frame, static_cast<int>(order.size()));
  const int first = std::min(options_.first_stage, total);
  int searched = 0;
  for (int k = 0; k < first; ++k) {
    Search(front_end, camera, map, prior, prior.world_from_camera, prior.covariance, matches.motion,
           filter.readout_s(), in_view[order[k]]);
    searched += in_view[order[k]].searched ? 1 : 0;
  }
  matches.pose = Solve(camera, prior, in_view, random);
  CatchUp(camera, filter, step, matches);
  if (filter.readout_s() != 0.0) matches.pose = Solve(camera, prior, in_view, random);
  // Nothing to search is no surprise: widening would only make it harder to find.
  matches.surprised = searched >= 8 && matches.pose.inliers < std::max(4, searched / 3);
  const bool known = matches.pose.inliers >= 3;
  const Rigid3 pose = known ? matches.pose.world_from_camera : prior.world_from_camera;
  const Matrix6d spread = known ? matches.pose.covariance : prior.covariance;
  for (int k = 0; k < total; ++k) {
    LandmarkMatch& match = in_view[order[k]];
    if (match.accepted() || (match.searched && !known)) continue;
    Search(front_end, camera, map, prior, pose, spread, matches.motion, filter.readout_s(), match);
  }
  matches.pose = Solve(camera, prior, in_view, random);
  CatchUp(camera, filter, step, matches);
  if (prior.covariance.diagonal().tail<3>().maxCoeff() > kUncertain_rad * kUncertain_rad) {
    HeedGroups(camera, filter, map, prior.covariance, matches);
  }
  for (const LandmarkMatch& match : in_view) {
    matches.attempted += match.searched ? 1 : 0;
    matches.accepted += match.accepted() ? 1 : 0;
    matches.hidden += match.hidden ? 1 : 0;
    matches.searched_px2 += match.searched_px2;
  }
  return matches;
}

}  // namespace saccade
