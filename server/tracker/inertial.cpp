// The part of the tracker that an inertial unit carries, once it has told the metre.
#include <cmath>

#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

constexpr int kSoughtEvery = 3;          // frames
constexpr double kLongestBlind_s = 4.0;  // that samples carry the camera with nothing seen

}  // namespace

bool Tracker::Carried() const { return guide_ != nullptr && filter_.inertial(); }

bool Tracker::Bridges(const Frame& frame) {
  if (!Carried() || !started_ || monitor_.status() == TrackingStatus::kLost) return false;
  const Timestamp from = last_frame_.capture_time_ns, to = frame.capture_time_ns;
  if (to <= from || Seconds(to - from) > kLongestBlind_s) return false;
  return Covers(guide_->Between(from, to), filter_.camera().imu.offset_s);
}

bool Tracker::PredictByUnit(double dt, const MotionNoise& noise) {
  if (!Carried()) return false;
  const Timestamp to = last_frame_.capture_time_ns;
  const auto from = to - static_cast<Timestamp>(std::llround(1e9 * dt));
  filter_.PredictInertial(guide_->Between(from, to), noise);
  return true;
}

void Tracker::Coast(double dt) {
  ++frames_;
  PredictByUnit(dt, {options_.acceleration_sigma_m_s2, options_.angular_acceleration_sigma_rad_s2});
  matches_ = FrameMatches();
  if (squares_) squares_->ForgetSearch();
  blind_s_ += dt;
  if (blind_s_ > kLongestBlind_s) {
    monitor_.Lose();
  } else {
    monitor_.Coast();
  }
}

bool Tracker::CoastsBlind(double dt) {
  const bool seen = matches_.accepted + SquaresFound() >= options_.coasting_below;
  if (!Carried() || monitor_.status() == TrackingStatus::kRelocalising || seen) {
    blind_s_ = 0.0;
    return false;
  }
  blind_s_ += dt;
  if (blind_s_ > kLongestBlind_s) return false;
  monitor_.Coast();
  return true;
}

bool Tracker::WaitsForUnit() const {
  return guide_ != nullptr && !metric_ && !filter_.inertial() && guide_->patient();
}

void Tracker::SeekUnit(const Frame& frame) {
  if (guide_ == nullptr || metric_ || !held_ || filter_.inertial()) return;
  guide_->Record(frame.capture_time_ns, filter_.camera().world_from_camera,
                 1.0 / depth_.inverse_range);
  // The last frame before nobody waits any longer is not missed.
  if (frames_ % kSoughtEvery != 0 && guide_->patient()) return;
  auto found = guide_->Find();
  if (!found) return;
  // Upright: y is down.
  const auto turn =
      Eigen::Quaterniond::FromTwoVectors(found->motion.imu.gravity_m_s2, Eigen::Vector3d::UnitY());
  MapCorrection correction;
  correction.of[0] = {found->metres_per_unit, turn, Eigen::Vector3d::Zero()};
  MoveMap(correction);
  if (squares_) squares_->ScaleViews(found->metres_per_unit);
  TurnWorld(turn, *found);
  const auto home = filter_.ClonePose(home_);
  filter_.StartInertial(*found, home ? home->translation : Eigen::Vector3d::Zero());
  guide_->Reset();
  metric_ = true;
}

}  // namespace saccade
