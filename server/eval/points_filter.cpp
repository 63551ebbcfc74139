#include "server/eval/points_filter.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <random>

namespace saccade {
namespace {

constexpr double kStartPosition_m = 0.01, kStartRotation_rad = 0.01;
constexpr double kStartVelocity_m_s = 0.05, kStartAngularVelocity_rad_s = 0.05;
constexpr std::size_t kMeasured = 25;      // a frame, as in a real run of modest cost
constexpr std::size_t kMaxFeatures = 120;  // in the state
constexpr std::size_t kBirths = 15;        // for one clone (slam-spec 5.4)
constexpr std::size_t kEnough = 20;        // matches that need no new features...
constexpr std::size_t kWorthAClone = 6;    // ...and fewest points that are worth a clone
constexpr double kRelativeDepthSigma = 0.5;
constexpr double kGateSigma = 3.0;        // of the search ellipse
constexpr double kVerifiedStart_s = 1.0;  // before, all matches are true: a start is checked
constexpr double kLeastWeight = 0.1;      // of a match that is used, as in the tracker

Matrix12d StartCovariance() {
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(kStartPosition_m),
      Eigen::Vector3d::Constant(kStartRotation_rad), Eigen::Vector3d::Constant(kStartVelocity_m_s),
      Eigen::Vector3d::Constant(kStartAngularVelocity_rad_s);
  return sigma.cwiseAbs2().asDiagonal();
}

FilterOptions OptionsOf(const PointsOptions& points, PointsMode mode) {
  FilterOptions options;
  options.fej = mode == PointsMode::kSlamFej;
  if (points.range_only) options.form = PointForm::kRangeOnly;
  return options;
}

CameraMotion TrueMotion(const PointsFrame& frame) {
  return {frame.world_from_camera, frame.velocity_in_world, frame.angular_velocity_in_camera};
}

}  // namespace

PointsFilter::PointsFilter(const PointsWorld& world, const PointsOptions& options, PointsMode mode)
    : world_(world),
      options_(options),
      mode_(mode),
      filter_(OptionsOf(options, mode)),
      id_of_point_(world.points.size(), 0) {
  std::mt19937_64 rng(options.seed ^ 0x5acadeULL);
  std::normal_distribution<double> normal;
  const Matrix12d covariance = StartCovariance();
  Vector12d error;
  for (int i = 0; i < error.size(); ++i) error[i] = std::sqrt(covariance(i, i)) * normal(rng);
  filter_.Reset(Plus(TrueMotion(world.frames.front()), error), covariance);
}

bool PointsFilter::IsKnown(int point) const {
  return mode_ == PointsMode::kKnownMap || point < options_.target_points;
}

std::vector<Observation> PointsFilter::Match(const PointsFrame& frame) const {
  std::vector<Observation> matches;
  for (const PointObservation& seen : frame.observations) {
    if (matches.size() == kMeasured && mode_ != PointsMode::kKnownMap) break;
    Observation observation;
    observation.pixel = seen.pixel;
    observation.noise = options_.noise_px * options_.noise_px * Eigen::Matrix2d::Identity();
    const auto point = static_cast<std::size_t>(seen.point);
    if (IsKnown(seen.point)) {
      observation.known_point = world_.points[point];
      if (!filter_.Predicted(world_.camera, world_.points[point])) continue;
    } else {
      observation.id = id_of_point_[point];
      if (observation.id == 0 || !filter_.Has(observation.id)) continue;
      if (!filter_.Predicted(world_.camera, observation.id)) continue;
    }
    matches.push_back(observation);
  }
  return matches;
}

void PointsFilter::Falsify(std::vector<Observation>& matches) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (Observation& match : matches) {
    if (0.5 * (uniform(random_) + 1.0) >= options_.false_matches) continue;
    const auto predicted = match.known_point ? filter_.Predicted(world_.camera, *match.known_point)
                                             : filter_.Predicted(world_.camera, match.id);
    const Eigen::Matrix2d ellipse =
        Eigen::LLT<Eigen::Matrix2d>(predicted->covariance + match.noise).matrixL();
    Eigen::Vector2d inside;
    do {
      inside = {uniform(random_), uniform(random_)};
    } while (inside.squaredNorm() > 1.0);
    match.pixel = predicted->at.pixel + kGateSigma * ellipse * inside;
  }
}

Rigid3 PointsFilter::LinearisationPose(std::vector<Observation>& matches) {
  std::vector<PoseEvidence> evidence;
  for (const Observation& match : matches) {
    PoseEvidence each;
    each.pixel = match.pixel;
    each.noise = match.noise;
    if (match.known_point) {
      each.point = *match.known_point;
      each.predicted = *filter_.Predicted(world_.camera, *match.known_point);
    } else {
      each.point = filter_.Point(match.id);
      each.predicted = *filter_.Predicted(world_.camera, match.id);
    }
    evidence.push_back(each);
  }
  const PosePrior prior = {filter_.camera().world_from_camera, filter_.PoseCovariance()};
  const RobustPose pose =
      EstimateRobustPose(world_.camera, prior, evidence, RobustPoseOptions(), random_);
  if (!options_.soft_gate) return pose.world_from_camera;
  // Points of the target that are refused together are right together: the map has outvoted them.
  int known = 0, refused = 0;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    known += matches[k].known_point ? 1 : 0;
    refused += matches[k].known_point && pose.weights[k] <= kLeastWeight ? 1 : 0;
  }
  const double least_known = 2 * refused > known ? options_.least_target_weight : 0.0;
  std::vector<Observation> kept;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const double least = matches[k].known_point ? least_known : 0.0;
    const double weight = std::max(pose.weights[k], least);
    if (weight <= kLeastWeight) continue;
    kept.push_back(matches[k]);
    kept.back().noise /= weight;
  }
  matches = std::move(kept);
  return pose.world_from_camera;
}

double PointsFilter::MedianInverseRange(const PointsFrame& frame) const {
  std::vector<double> all;
  const Eigen::Vector3d& eye = filter_.camera().world_from_camera.translation;
  for (const PointObservation& seen : frame.observations) {
    const auto point = static_cast<std::size_t>(seen.point);
    if (IsKnown(seen.point)) {
      all.push_back(1.0 / (world_.points[point] - eye).norm());
    } else if (const FeatureId id = id_of_point_[point]; id != 0 && filter_.Has(id)) {
      const FeatureMarginal marginal = filter_.Marginal(id);
      if (marginal.inverse_range_sigma < 0.2 * marginal.inverse_range) {
        all.push_back(1.0 / (marginal.point_in_world - eye).norm());
      }
    }
  }
  if (all.empty()) return 0.5;
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  return all[all.size() / 2];
}

absl::Status PointsFilter::Birth(const PointsFrame& frame, std::size_t matched) {
  if (mode_ == PointsMode::kKnownMap || matched >= kEnough) return absl::OkStatus();
  std::vector<const PointObservation*> fresh;
  for (const PointObservation& seen : frame.observations) {
    if (fresh.size() == kBirths || filter_.feature_count() + fresh.size() >= kMaxFeatures) break;
    if (!IsKnown(seen.point) && !mapped_.contains(seen.point)) fresh.push_back(&seen);
  }
  if (fresh.size() < kWorthAClone) return absl::OkStatus();
  const double inverse_range = MedianInverseRange(frame);
  const CloneId clone = filter_.AddClone();
  for (const PointObservation* seen : fresh) {
    Eigen::Matrix<double, 3, 2> d_bearing;
    const auto bearing = world_.camera.Unproject(seen->pixel, &d_bearing);
    if (!bearing) continue;
    FeatureBirth birth;
    birth.id = next_id_++;
    birth.bearing = *bearing;
    birth.bearing_covariance =
        options_.noise_px * options_.noise_px * d_bearing * d_bearing.transpose();
    birth.inverse_range = inverse_range;
    birth.inverse_range_sigma = kRelativeDepthSigma * inverse_range;
    if (const absl::Status status = filter_.AddFeature(clone, birth); !status.ok()) return status;
    mapped_.insert(seen->point);
    id_of_point_[static_cast<std::size_t>(seen->point)] = birth.id;
  }
  return absl::OkStatus();
}

absl::StatusOr<PointsStep> PointsFilter::Step(std::size_t index) {
  const PointsFrame& frame = world_.frames[index];
  const MotionNoise noise = {options_.linear_sigma, options_.angular_sigma};
  if (index > 0) filter_.Predict(world_.dt_s, noise);
  std::vector<Observation> matches = Match(frame);
  if (options_.false_matches > 0.0 && index * world_.dt_s >= kVerifiedStart_s) Falsify(matches);
  PointsStep step;
  const Rigid3 linearisation = LinearisationPose(matches);
  step.matches = static_cast<int>(matches.size());
  if (!matches.empty()) {
    const auto report = filter_.Update(world_.camera, matches, linearisation);
    if (!report.ok()) return report.status();
    step.nis = report->nis;
  }
  filter_.RemoveBehind();
  if (const absl::Status status = Birth(frame, matches.size()); !status.ok()) return status;
  const Vector12d error = Minus(TrueMotion(frame), filter_.camera());
  const Eigen::LDLT<Matrix6d> covariance(filter_.PoseCovariance());
  if (covariance.info() != Eigen::Success || !covariance.isPositive()) {
    return absl::FailedPreconditionError(
        absl::StrCat("frame ", index, ": the pose covariance is not positive definite"));
  }
  step.nees = error.head<6>().dot(covariance.solve(error.head<6>()));
  const Eigen::Matrix3d of_position = filter_.PoseCovariance().topLeftCorner<3, 3>();
  step.position_nees = error.head<3>().dot(of_position.ldlt().solve(error.head<3>()));
  step.position_error_m = error.head<3>().norm();
  step.rotation_error_rad = error.segment<3>(3).norm();
  return step;
}

}  // namespace saccade
