// The part of the tracker that puts landmarks to rest and wakes them.
#include "server/tracker/tracker_impl.hpp"

namespace saccade {
namespace {

// Well enough known to be found again.
constexpr std::uint32_t kMature = 15;       // matches
constexpr double kDepthKnown = 0.1;         // sigma / inverse range
constexpr double kSeedDepthKnown = 0.02;    // the same of a seeded one: a mark waits for its depth
constexpr double kMoved = 0.1;              // of the distance to what is in view
constexpr double kLeastDepthSigma = 0.005;  // a woken one's; of its inverse range
constexpr std::int64_t kPause = 150;        // frames that one rests which was woken in vain
constexpr int kMostFailures = 3;
constexpr int kMostAtOnce = 30;

/// How often it was woken in vain.
int Failures(const Landmark& landmark) {
  if (!landmark.woken) return 0;
  return landmark.woken->failures + (MapKeeper::FailsProbation(landmark) ? 1 : 0);
}

}  // namespace

bool Tracker::Impl::MayRest(const Landmark& landmark) const {
  if (!options_.wake || landmark.known || landmark.matched < kMature ||
      Failures(landmark) >= kMostFailures || !filter_.Has(landmark.id) ||
      !refiner_.Remember(landmark.id)) {
    return false;
  }
  const FeatureMarginal marginal = filter_.Marginal(landmark.id);
  const double enough = landmark.seeded ? kSeedDepthKnown : kDepthKnown;
  return marginal.inverse_range_sigma <= enough * marginal.inverse_range;
}

bool Tracker::Impl::HasMovedFrom(const Landmark& landmark) const {
  const auto known = refiner_.Remember(landmark.id);
  if (!known) return false;
  const Eigen::Vector3d way =
      filter_.camera().world_from_camera.translation - known->world_from_anchor.translation;
  return way.norm() * depth_.inverse_range > kMoved;
}

void Tracker::Impl::Rest(std::span<const FeatureId> ids) {
  for (const FeatureId id : ids) {
    const Landmark* landmark = map_.Find(id);
    if (landmark == nullptr || !MayRest(*landmark)) continue;
    const FeatureMarginal marginal = filter_.Marginal(id);
    const bool failed = MapKeeper::FailsProbation(*landmark);
    DormantLandmark dormant;
    dormant.landmark = *landmark;
    dormant.failures = Failures(*landmark);
    dormant.inverse_range_sigma = marginal.inverse_range_sigma;
    dormant.covariance_in_world = marginal.covariance_in_world;
    dormant.home = home_;
    dormant.rests_until = failed ? frames_ + kPause : 0;
    // What was woken in vain has taught the filter nothing.
    if (!failed) refiner_.Rest(id, filter_);
    dormant_.Put(std::move(dormant));
  }
  filter_.Remove(ids);
  map_.Remove(ids);
  LocateDormant();
}

Matrix6d Tracker::Impl::WakeCovariance(double distance_m) const {
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Eigen::Vector3d::Constant(options_.wake_position_share * distance_m),
      Eigen::Vector3d::Constant(options_.wake_angle_sigma_rad);
  return sigma.cwiseAbs2().asDiagonal();
}

void Tracker::Impl::Wake(const CameraModel& camera) {
  const int missing = std::min(kMostAtOnce, keeper_.Missing(matches_));
  if (!options_.wake || missing <= 0 || dormant_.size() == 0) return;
  LocateDormant();
  std::vector<Eigen::Vector2d> occupied;
  for (const LandmarkMatch& match : matches_.in_view) occupied.push_back(match.pixel);
  const auto groups =
      dormant_.InView(camera, filter_.camera().world_from_camera, frames_, missing, occupied);
  const double distance_m = 1.0 / std::max(1e-6, depth_.inverse_range);
  for (const auto& [keyframe, ids] : groups) {
    const AnchorPoseId clone = refiner_.CloneOf(keyframe, WakeCovariance(distance_m), filter_);
    for (const FeatureId id : ids) WakeOne(id, clone, *refiner_.Remember(id));
  }
  filter_.Remove({});  // a clone that nothing was woken in goes again
}

void Tracker::Impl::WakeOne(FeatureId id, AnchorPoseId clone,
                            const KeyframeGraph::Remembered& known) {
  DormantLandmark dormant = dormant_.Take(id);
  FeatureBirth birth;
  birth.id = id;
  birth.bearing = known.estimate.bearing;
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(birth.bearing);
  birth.bearing_covariance =
      known.bearing_sigma_rad * known.bearing_sigma_rad * basis * basis.transpose();
  birth.inverse_range = known.estimate.inverse_range;
  birth.inverse_range_sigma =
      std::max(dormant.inverse_range_sigma, kLeastDepthSigma * birth.inverse_range);
  if (!filter_.AddFeature(clone, birth).ok()) return;
  Landmark& landmark = dormant.landmark;
  landmark.woken = Landmark::Probation{.failures = dormant.failures};
  landmark.failed_in_row = 0;
  landmark.last_matched_frame = landmark.last_in_view_frame = frames_;
  map_.Add(std::move(landmark));
}

void Tracker::Impl::Remember(const CameraModel& camera) {
  using Life = KeyframeGraph::Life;
  refiner_.Keep(camera, filter_, matches_, depth_.inverse_range, [this](FeatureId id) {
    return filter_.Has(id) ? Life::kInFilter : dormant_.Has(id) ? Life::kAtRest : Life::kGone;
  });
}

std::optional<Eigen::Vector3d> Tracker::Impl::PointNow(FeatureId id) const {
  const Landmark* landmark = map_.Find(id);
  if (landmark != nullptr && landmark->known) return landmark->known->point_in_world;
  if (landmark != nullptr && filter_.Has(id)) return filter_.Marginal(id).point_in_world;
  if (!dormant_.Has(id)) return std::nullopt;
  const auto known = refiner_.Remember(id);
  if (!known || !(known->estimate.inverse_range > 0.0)) return std::nullopt;
  return known->PointInWorld();
}

void Tracker::Impl::LocateDormant() {
  dormant_.Locate([this](KeyframeId id) { return refiner_.graph().Version(id); },
                  [this](FeatureId id) { return refiner_.Remember(id); });
}

void Tracker::Impl::PublishDormant(MapSnapshot& snapshot) const {
  const Rigid3 camera_from_world = snapshot.world_from_camera.Inverse();
  const Eigen::Matrix3d turn = camera_from_world.RotationMatrix();
  for (const auto& [id, dormant] : dormant_.all()) {
    if (!dormant.place.somewhere) continue;
    FeatureSnapshot& feature = snapshot.features.emplace_back();
    feature.id = id;
    feature.matched_count = dormant.landmark.matched;
    feature.point_in_world = dormant.place.point_in_world;
    // As well as it was known. While errors are counted from the same place as then that is all;
    // later its keyframe is as well known as it will be when it is woken.
    feature.covariance_in_world = dormant.covariance_in_world;
    if (dormant.home != home_) {
      const double off = options_.wake_position_share * dormant.place.range_m;
      feature.covariance_in_world += off * off * Eigen::Matrix3d::Identity();
    }
    feature.covariance_in_camera = turn * feature.covariance_in_world * turn.transpose();
    feature.depth_known = true;
  }
}

}  // namespace saccade
