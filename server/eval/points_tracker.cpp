#include "server/eval/points_tracker.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr std::size_t kMaxFeatures = 100;  // in the state
constexpr std::size_t kBirths = 15;        // for one clone (slam-spec 5.4)
constexpr int kEnough = 40;                // matches that need no new features
constexpr std::size_t kWorthAClone = 4;    // fewest points that are worth a clone
constexpr int kFewest = 5;                 // matches of a frame that was followed
constexpr int kFramesBetweenBirths = 5;
constexpr double kRelativeDepthSigma = 0.5;
constexpr double kGateSquared = 9.0;  // of the search ellipse, 3 sigma
constexpr double kLeastWeight = 0.1;  // of a match that is used, as in the tracker
constexpr double kBorder_px = 12.0;   // a prediction nearer to the edge is no attempt
constexpr double kSurprise = 3.0;     // times the motion noise, after an unexpected move
constexpr double kTelling = 0.3;      // share of attempts below which a frame judges no feature

Matrix12d StartCovariance() {
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(0.01), Eigen::Vector3d::Constant(0.01),
      Eigen::Vector3d::Constant(0.05), Eigen::Vector3d::Constant(0.05);
  return sigma.cwiseAbs2().asDiagonal();
}

CameraMotion TrueMotion(const PointsFrame& frame) {
  return {frame.world_from_camera, frame.velocity_in_world, frame.angular_velocity_in_camera};
}

FilterOptions OptionsOf(const PointsOptions& points) {
  FilterOptions options;
  if (points.range_only) options.form = PointForm::kRangeOnly;
  return options;
}

}  // namespace

PointsTracker::PointsTracker(const PointsWorld& world, const PointsOptions& options,
                             const PointsFrame& first)
    : world_(world),
      options_(options),
      filter_(OptionsOf(options)),
      random_(options.seed ^ 0x7aceULL) {
  std::normal_distribution<double> normal;
  const Matrix12d covariance = StartCovariance();
  Vector12d error;
  for (int i = 0; i < error.size(); ++i) error[i] = std::sqrt(covariance(i, i)) * normal(random_);
  filter_.Reset(Plus(TrueMotion(first), error), covariance);
}

std::optional<int> PointsTracker::AgeOf(int point) const {
  const auto at = feature_on_.find(point);
  if (at == feature_on_.end()) return std::nullopt;
  return static_cast<int>(frame_ - born_.at(at->second));
}

std::vector<PointsTracker::Match> PointsTracker::Search(const PointsFrame& frame) const {
  std::map<int, Eigen::Vector2d> seen;
  for (const PointObservation& each : frame.observations) seen[each.point] = each.pixel;
  std::vector<Match> matches;
  const auto add = [&](int point, FeatureId id, const std::optional<PredictedPixel>& predicted,
                       const std::variant<PointFromClone, Eigen::Vector3d>& place) {
    if (!predicted || !world_.camera.InImage(predicted->at.pixel, kBorder_px)) return;
    Match match;
    match.id = id;
    match.known = id == 0;
    match.evidence.point = place;
    match.evidence.predicted = *predicted;
    match.evidence.noise = options_.noise_px * options_.noise_px * Eigen::Matrix2d::Identity();
    if (const auto at = seen.find(point); at != seen.end()) {
      match.evidence.pixel = at->second;
      const Eigen::Matrix2d spread = predicted->covariance + match.evidence.noise;
      const Eigen::Vector2d off = at->second - predicted->at.pixel;
      match.found = off.dot(spread.ldlt().solve(off)) < kGateSquared;
    }
    matches.push_back(match);
  };
  for (int point = 0; point < options_.target_points; ++point) {
    const Eigen::Vector3d& place = world_.points[static_cast<std::size_t>(point)];
    add(point, 0, filter_.Predicted(world_.camera, place), place);
  }
  for (const Landmark& landmark : map_.all()) {
    add(point_of_.at(landmark.id), landmark.id, filter_.Predicted(world_.camera, landmark.id),
        filter_.Point(landmark.id));
  }
  return matches;
}

absl::Status PointsTracker::Correct(std::vector<Match>& matches) {
  std::vector<PoseEvidence> evidence;
  for (const Match& match : matches) {
    if (match.found) evidence.push_back(match.evidence);
  }
  if (evidence.empty()) return absl::OkStatus();
  const PosePrior prior = {filter_.camera().world_from_camera, filter_.PoseCovariance()};
  const RobustPose pose =
      EstimateRobustPose(world_.camera, prior, evidence, RobustPoseOptions(), random_);
  // Points of the target that are refused together are right together: the map has outvoted them.
  int known = 0, refused = 0;
  std::size_t k = 0;
  for (const Match& match : matches) {
    if (!match.found) continue;
    known += match.known ? 1 : 0;
    refused += match.known && pose.weights[k] <= kLeastWeight ? 1 : 0;
    ++k;
  }
  const double least_known = 2 * refused > known ? options_.least_target_weight : 0.0;
  std::vector<Observation> observations;
  k = 0;
  for (Match& match : matches) {
    if (!match.found) continue;
    const double weight = std::max(pose.weights[k++], match.known ? least_known : 0.0);
    match.accepted = weight > kLeastWeight;
    if (!match.accepted) continue;
    Observation observation;
    observation.id = match.id;
    if (match.known) observation.known_point = std::get<Eigen::Vector3d>(match.evidence.point);
    observation.pixel = match.evidence.pixel;
    observation.noise = match.evidence.noise / weight;
    observations.push_back(observation);
  }
  return filter_.Update(world_.camera, observations, pose.world_from_camera).status();
}

void PointsTracker::Retire(const std::vector<Match>& matches) {
  int accepted = 0;
  for (const Match& match : matches) accepted += match.accepted ? 1 : 0;
  const bool telling = accepted >= kTelling * static_cast<double>(matches.size());
  for (const Match& match : matches) {
    if (match.known || (!telling && !match.accepted)) continue;
    map_.Find(match.id)->Record(match.accepted, frame_);
  }
  std::vector<FeatureId> gone = Unreliable(map_, RetirementOptions());
  filter_.Remove(gone);
  for (const FeatureId id : filter_.RemoveBehind()) gone.push_back(id);
  const int excess = static_cast<int>(filter_.feature_count()) - static_cast<int>(kMaxFeatures);
  map_.Remove(gone);
  if (excess > 0) {
    const std::vector<FeatureId> least = LeastWorth(map_, excess, frame_);
    filter_.Remove(least);
    map_.Remove(least);
    gone.insert(gone.end(), least.begin(), least.end());
  }
  for (const FeatureId id : gone) {
    feature_on_.erase(point_of_.at(id));
    point_of_.erase(id);
    born_.erase(id);
  }
}

double PointsTracker::MedianInverseRange(const std::vector<Match>& matches) const {
  std::vector<double> all;
  const Eigen::Vector3d& eye = filter_.camera().world_from_camera.translation;
  for (const Match& match : matches) {
    if (!match.accepted) continue;
    if (match.known) {
      all.push_back(1.0 / (std::get<Eigen::Vector3d>(match.evidence.point) - eye).norm());
    } else if (filter_.Has(match.id)) {
      const FeatureMarginal marginal = filter_.Marginal(match.id);
      if (marginal.inverse_range_sigma > 0.3 * marginal.inverse_range) continue;
      all.push_back(1.0 / (marginal.point_in_world - eye).norm());
    }
  }
  if (all.size() < 3) return inverse_range_;
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  return all[all.size() / 2];
}

absl::Status PointsTracker::Birth(const PointsFrame& frame, int accepted) {
  if (accepted >= kEnough || frame_ - last_birth_ < kFramesBetweenBirths) return absl::OkStatus();
  std::vector<const PointObservation*> fresh;
  for (const PointObservation& seen : frame.observations) {
    if (seen.point < options_.target_points || feature_on_.contains(seen.point)) continue;
    if (world_.camera.InImage(seen.pixel, kBorder_px)) fresh.push_back(&seen);
  }
  if (fresh.size() < kWorthAClone) return absl::OkStatus();
  for (std::size_t k = fresh.size(); k > 1; --k) std::swap(fresh[k - 1], fresh[random_() % k]);
  fresh.resize(std::min(fresh.size(), kBirths));
  last_birth_ = frame_;
  const CloneId clone = filter_.AddClone();
  for (const PointObservation* seen : fresh) {
    Eigen::Matrix<double, 3, 2> d_bearing;
    const auto bearing = world_.camera.Unproject(seen->pixel, &d_bearing);
    if (!bearing) continue;
    Landmark landmark;
    landmark.id = map_.NextId();
    FeatureBirth birth;
    birth.id = landmark.id;
    birth.bearing = *bearing;
    birth.bearing_covariance =
        options_.noise_px * options_.noise_px * d_bearing * d_bearing.transpose();
    birth.inverse_range = inverse_range_;
    birth.inverse_range_sigma = kRelativeDepthSigma * inverse_range_;
    if (const absl::Status status = filter_.AddFeature(clone, birth); !status.ok()) return status;
    landmark.last_matched_frame = frame_;
    map_.Add(std::move(landmark));
    point_of_[birth.id] = seen->point;
    feature_on_[seen->point] = birth.id;
    born_[birth.id] = frame_;
  }
  return absl::OkStatus();
}

absl::StatusOr<PointsTrackStep> PointsTracker::Step(const PointsFrame& frame) {
  if (++frame_ > 0) {
    filter_.Predict(world_.dt_s, {options_.linear_sigma, options_.angular_sigma});
  }
  std::vector<Match> matches = Search(frame);
  const auto found = std::count_if(matches.begin(), matches.end(), [](auto& m) { return m.found; });
  if (followed_ && static_cast<double>(found) < kTelling * static_cast<double>(matches.size())) {
    // Beyond what the motion model thinks possible: look again, wider, once (as the tracker does).
    const MotionNoise wild = {kSurprise * options_.linear_sigma,
                              kSurprise * options_.angular_sigma};
    const Rigid3& pose = filter_.camera().world_from_camera;
    filter_.Inflate(LineariseMotion(filter_.camera(), pose.rotation, world_.dt_s, wild).q);
    matches = Search(frame);
  }
  if (const absl::Status status = Correct(matches); !status.ok()) return status;
  PointsTrackStep step;
  step.attempted = static_cast<int>(matches.size());
  for (const Match& match : matches) step.accepted += match.accepted ? 1 : 0;
  followed_ = step.accepted >= kFewest;
  inverse_range_ = MedianInverseRange(matches);
  Retire(matches);
  if (const absl::Status status = Birth(frame, step.accepted); !status.ok()) return status;
  const Vector12d error = Minus(TrueMotion(frame), filter_.camera());
  if (!error.allFinite()) return absl::FailedPreconditionError("the pose is not a number");
  step.position_error_m = error.head<3>().norm();
  step.rotation_error_rad = error.segment<3>(3).norm();
  return step;
}

}  // namespace saccade
