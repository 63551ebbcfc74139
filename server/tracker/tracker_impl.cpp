#include "server/tracker/tracker_impl.hpp"

#include <cstring>

#include "server/capture/gap.hpp"
#include "server/filter/new_clone.hpp"
#include "server/pipeline/stop_watch.hpp"
#include "server/tracker/encoder_motion.hpp"

namespace saccade {
namespace {

constexpr int kSettledFeatures = 12;     // with known depth, before poses are published
constexpr int kLongestSettling = 15;     // frames: under pure rotation depth never settles
constexpr double kSettledDepth = 0.25;   // sigma / inverse range
constexpr int kFewestToUpdate = 3;       // matches: fewer can agree by chance
constexpr double kLooseTie_rad = 0.005;  // of what is in view to the clone that errors count from
constexpr int kRepeats = 2;              // of a picture, as a source does that fills up its rate
constexpr int kYoungMap = 60;            // frames tracked in it, before it is worth waiting for
constexpr int kPatience = 30;            // frames lost, before a young map is given up
constexpr double kSurprise = 3.0;        // times the motion noise, after an unexpected move

bool SamePicture(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), bytes) != 0) return false;
  }
  return true;
}

/// The camera's own word on its shutter, else the filter finds out.
FilterOptions MakeFilterOptions(const TrackerOptions& options, const CameraModel& camera) {
  constexpr double kSurely = 0.1;  // of a read-out time that camera.yaml gives
  FilterOptions filter;
  filter.readout_s = camera.intrinsics().rolling_shutter_readout_s;
  filter.readout_sigma_s =
      filter.readout_s > 0.0 ? kSurely * filter.readout_s : options.readout_sigma_s;
  filter.fej = options.fej;
  filter.fej_updates = options.fej_updates;
  filter.parallax_sigmas = options.parallax_sigmas;
  filter.carry_scale_after = options.carry_scale_after;
  filter.form = options.range_only ? PointForm::kRangeOnly : PointForm::kBearingRange;
  return filter;
}

RelocaliserOptions MakeRelocaliserOptions(const TrackerOptions& options) {
  RelocaliserOptions relocaliser;
  relocaliser.seed = options.seed;
  return relocaliser;
}

}  // namespace

Tracker::Impl::Impl(const SourceInfo& source, const TrackerOptions& options)
    : source_(source),
      options_(options),
      random_(options.seed),
      filter_(MakeFilterOptions(options, *source.camera)),
      matcher_(options),
      keeper_(options),
      starter_(source, options),
      monitor_(options),
      relocaliser_(MakeRelocaliserOptions(options)),
      refiner_(options),
      finder_(options),
      loops_(options, relocaliser_) {}

void Tracker::Impl::Reset() {
  loops_.Reset();
  filter_.Reset(CameraMotion(), Matrix12d::Zero());
  map_.Clear();
  keeper_.Reset();
  starter_.Reset();
  monitor_.Reset();
  relocaliser_.Clear();
  refiner_.Reset();
  finder_.Reset();
  matches_ = FrameMatches();
  before_relocalisation_.reset();
  started_ = metric_ = held_ = has_frame_ = false;
  head_rate_rad_s_ = 0.0;
  frames_ = frames_lost_ = frames_tracked_ = 0;
  home_ = 1;
  ++generation_;
  ++revision_;
}

void Tracker::Impl::StartAnew(const Frame& frame) {
  Reset();
  last_frame_ = frame;
  has_frame_ = true;
  Begin(frame);
}

bool Tracker::Impl::Hopeless() const {
  if (!held_) return true;
  return !metric_ && frames_tracked_ < kYoungMap && frames_lost_ > kPatience;
}

std::shared_ptr<const MapSnapshot> Tracker::Impl::Track(const Frame& frame) {
  StopWatch total;
  times_ = StageTimes();
  const bool usable = frame.camera != nullptr && frame.grey.cols == source_.camera->width() &&
                      frame.grey.rows == source_.camera->height();
  const double dt = has_frame_ ? Seconds(frame.capture_time_ns - last_frame_.capture_time_ns) : 0.0;
  const bool gap = has_frame_ && IsGap(last_frame_.capture_time_ns, frame.capture_time_ns);
  if (!usable || (has_frame_ && dt <= 0.0 && !gap) || !pyramid_.Build(frame.grey).ok()) {
    return Publish(frame, times_);
  }
  // One picture again is no measurement: what moves meanwhile is a gap when the next one comes.
  if (has_frame_ && !gap && SamePicture(frame.grey, last_frame_.grey)) {
    if (started_ && ++repeated_ > kRepeats) monitor_.Suspend();
    return Publish(frame, times_);
  }
  repeated_ = 0;
  if (has_frame_) rate_.Add(dt);
  if (gap) ResumeAfterGap();
  previous_mount_ = has_frame_ ? last_frame_.mount : std::nullopt;
  last_frame_ = frame;
  if (last_frame_.mount && !ToVector(*last_frame_.mount).allFinite()) last_frame_.mount.reset();
  has_frame_ = true;
  if (!started_) {
    Begin(frame);
  } else if (monitor_.status() == TrackingStatus::kLost && Hopeless()) {
    StartAnew(frame);
  } else if (monitor_.status() == TrackingStatus::kLost) {
    refiner_.Drop(filter_);
    loops_.Reset();
    Recover(frame);
  } else {
    Follow(frame, dt);
  }
  frames_tracked_ += monitor_.status() == TrackingStatus::kTracking ? 1 : 0;
  times_.total_ms = total.Lap_ms() - times_.waited_ms;
  return Publish(frame, times_);
}

void Tracker::Impl::Begin(const Frame& frame) {
  StopWatch watch;
  matches_ = FrameMatches();
  const auto start = starter_.Try(frame, pyramid_, filter_, map_.in_use());
  times_.search_ms = watch.Lap_ms();
  if (!start) {
    monitor_.WaitForStart();
    return;
  }
  metric_ = start->metric;
  held_ = metric_ || !options_.start;
  depth_ = start->depth;
  matches_ = matcher_.Match(pyramid_, *frame.camera, filter_, map_.in_use(), MotionStep(), random_);
  keeper_.Grow(frame, pyramid_, matches_, depth_, /*everywhere=*/true, matcher_, filter_,
               map_.in_use(), random_);
  started_ = filter_.feature_count() > 0 || !map_.in_use().all().empty();
  times_.manage_ms = watch.Lap_ms();
  if (!started_) return;  // nothing to see at all: try again with the next frame
  frames_ = 0;
  // Features that are born in this frame are seen in it.
  const int born = static_cast<int>(filter_.feature_count());
  matches_.attempted += born;
  matches_.accepted += born;
  if (held_) {
    KeepForAdjustment(*frame.camera);
  } else {
    finder_.Record(frame.capture_time_ns, *frame.camera, filter_, map_.in_use(), matches_);
  }
  if (metric_) monitor_.Record(matches_.attempted, matches_.accepted, true);
}

bool Tracker::Impl::Settled() const {
  if (!held_) return false;
  if (options_.start || metric_ || frames_ >= kLongestSettling ||
      monitor_.status() != TrackingStatus::kInitialising) {
    return true;
  }
  int known = 0;
  for (const LandmarkMatch& match : matches_.in_view) {
    if (!match.accepted() || !filter_.Has(match.id)) continue;
    const FeatureMarginal marginal = filter_.Marginal(match.id);
    known += marginal.inverse_range_sigma < kSettledDepth * marginal.inverse_range ? 1 : 0;
  }
  return known >= kSettledFeatures;
}

void Tracker::Impl::PredictAndSearch(const CameraModel& camera, double dt) {
  StopWatch watch;
  MotionNoise noise{options_.acceleration_sigma_m_s2, options_.angular_acceleration_sigma_rad_s2};
  const MotionNoise wild{kSurprise * noise.acceleration_m_s2,
                         kSurprise * noise.angular_acceleration_rad_s2};
  std::optional<HeadMotion> head;
  if (options_.encoders && source_.mount && previous_mount_ && last_frame_.mount) {
    head = EncoderMotion(*source_.mount, *previous_mount_, *last_frame_.mount, dt, metric_);
    noise = {options_.worn_acceleration_sigma_m_s2,
             options_.worn_angular_acceleration_sigma_rad_s2};
  }
  const CameraMotion before = filter_.camera();
  // Once: in a row of blind frames every widening would make the next search more hopeless.
  const bool followed = matches_.accepted >= options_.coasting_below;
  filter_.Predict(dt, noise, head ? &*head : nullptr);
  const double rate = head ? LogQuaternion(head->camera_from_next.rotation).norm() / dt : 0.0;
  suspended_ = RateWhenExposed(rate, head_rate_rad_s_) > options_.suspend_rate_rad_s;
  head_rate_rad_s_ = rate;
  if (!suspended_) Wake(camera);
  times_.predict_ms = watch.Lap_ms();
  if (suspended_) {
    matches_ = FrameMatches();
    return;
  }
  matches_ = matcher_.Match(pyramid_, camera, filter_, map_.in_use(), {dt, noise}, random_);
  if (matches_.surprised && followed) {
    filter_.Inflate(LineariseMotion(before, before.world_from_camera.rotation, dt, wild).q);
    const double searched_px2 = matches_.searched_px2;
    matches_ = matcher_.Match(pyramid_, camera, filter_, map_.in_use(), {dt, noise}, random_);
    matches_.searched_px2 += searched_px2;
  }
  times_.search_ms = watch.Lap_ms();
}

void Tracker::Impl::Correct(const CameraModel& camera) {
  StopWatch watch;
  if (matches_.accepted >= kFewestToUpdate) {
    std::vector<Observation> observations;
    for (const LandmarkMatch& match : matches_.in_view) {
      if (!match.accepted()) continue;
      Observation observation;
      observation.id = match.id;
      if (const auto* known = std::get_if<Eigen::Vector3d>(&match.point)) {
        observation.known_point = *known;
      }
      observation.pixel = match.pixel - match.row_shift;
      observation.d_readout = match.d_readout;
      observation.noise = match.noise / match.weight;  // soft gate
      observations.push_back(observation);
    }
    const auto report = filter_.Update(camera, observations, matches_.pose.world_from_camera);
    if (!report.ok()) matches_.accepted = 0;
  }
  times_.update_ms = watch.Lap_ms();
}

void Tracker::Impl::Follow(const Frame& frame, double dt) {
  ++frames_;
  PredictAndSearch(*frame.camera, dt);
  if (suspended_) {
    monitor_.Suspend();
    return;
  }
  Correct(*frame.camera);
  StopWatch watch;
  rate_.Record(matches_.attempted, matches_.accepted, MovedPx(*frame.camera, dt));
  monitor_.Record(matches_.attempted, matches_.accepted, Settled());
  const bool confirmed = monitor_.status() == TrackingStatus::kTracking ||
                         monitor_.status() == TrackingStatus::kInitialising;
  if (monitor_.refused()) {
    Revert();
  } else if (confirmed) {
    before_relocalisation_.reset();
    Manage(frame);
  }
  times_.manage_ms = watch.Lap_ms() - times_.waited_ms;
}

/// How far things moved in the picture since the one before, about; nothing: too little was found.
std::optional<double> Tracker::Impl::MovedPx(const CameraModel& camera, double dt) const {
  if (matches_.accepted < options_.coasting_below) return std::nullopt;
  const double rate = matches_.motion.angular_velocity_rad_s.norm() +
                      matches_.motion.velocity_m_s.norm() * depth_.inverse_range;
  return dt * rate * camera.intrinsics().fx;
}

/// The target leaves; what was seen of it in this frame stays as ordinary features, at the depth
/// that the target gave. So scale does not rest on parallax alone if the wearer stood still at the
/// start.
void Tracker::Impl::KeepTargetPoints(const Frame& frame) {
  constexpr double kDepthSigma = 0.01;  // of the range
  std::optional<NewClone> clone;
  const Rigid3 camera_from_world = filter_.camera().world_from_camera.Inverse();
  for (const LandmarkMatch& match : matches_.in_view) {
    const auto* point = std::get_if<Eigen::Vector3d>(&match.point);
    if (point == nullptr || !match.accepted()) continue;
    if (!clone) clone.emplace(filter_);
    const double inverse = 1.0 / (camera_from_world * *point).norm();
    keeper_.Plant(frame, match.pixel, {inverse, kDepthSigma * inverse}, clone->id(),
                  matches_.motion, matcher_, filter_, map_.in_use());
  }
}

void Tracker::Impl::MoveHome() {
  if (options_.home_share <= 0.0) return;
  std::vector<AnchorPoseId> seen_from;
  for (const LandmarkMatch& match : matches_.in_view) {
    if (std::holds_alternative<Eigen::Vector3d>(match.point)) return;  // the target is the world
    if (match.accepted() && filter_.Has(match.id)) seen_from.push_back(filter_.AnchorOf(match.id));
  }
  if (seen_from.empty()) return;
  const auto from_home = std::count_if(seen_from.begin(), seen_from.end(),
                                       [&](AnchorPoseId id) { return id <= home_; });
  const auto middle = seen_from.begin() + std::ssize(seen_from) / 2;
  std::nth_element(seen_from.begin(), middle, seen_from.end());
  const bool far =
      from_home < options_.home_share * static_cast<double>(seen_from.size()) && *middle > home_;
  // Back at places older than home, or woken ones: what counts is how surely they are tied to it.
  const bool loose = filter_.DirectionSigma(*middle) > kLooseTie_rad;
  if ((far || loose) && filter_.CountErrorsFrom(*middle)) home_ = *middle;
}

void Tracker::Impl::Manage(const Frame& frame) {
  // A frame in which hardly anything was found says nothing about single features.
  const bool telling = matches_.accepted >= 0.3 * matches_.attempted;
  for (const LandmarkMatch& match : matches_.in_view) {
    Landmark& landmark = *map_.in_use().Find(match.id);
    landmark.last_in_view_frame = frames_;
    if (!match.searched || (!telling && !match.accepted())) continue;
    landmark.Record(match.accepted(), frames_);
  }
  if (starter_.TargetExpired(frames_) && matches_.accepted > 0) {
    KeepTargetPoints(frame);
    std::vector<FeatureId> expired;
    for (const Landmark& landmark : map_.in_use().all()) {
      if (landmark.known) expired.push_back(landmark.id);
    }
    map_.in_use().Remove(expired);
    std::erase_if(matches_.in_view, [](const LandmarkMatch& match) {
      return std::holds_alternative<Eigen::Vector3d>(match.point);
    });
  }
  keeper_.Retire(
      frames_, filter_, map_.in_use(), [this](std::span<const FeatureId> ids) { Rest(ids); },
      [this](const Landmark& landmark) { return MayRest(landmark); },
      [this](const Landmark& landmark) { return HasMovedFrom(landmark); });
  // With most of the view covered the little that is left is no place to start features from: it
  // would be lost when the cover goes (T46).
  const bool covered = matches_.hidden > matches_.attempted;
  if (!held_) {
    if (telling && !covered) {
      keeper_.Grow(frame, pyramid_, matches_, depth_, /*everywhere=*/false, matcher_, filter_,
                   map_.in_use(), random_);
    }
    SeekStart(frame);
    return;
  }
  MoveHome();
  if (refiner_.Finish(frames_, frame.capture_time_ns, depth_.inverse_range, map_, filter_)) {
    ++revision_;
  }
  times_.waited_ms = refiner_.waited_ms();
  if (!telling || covered) return;
  if (const auto guess = MapKeeper::GuessDepth(filter_, matches_)) depth_ = *guess;
  keeper_.Grow(frame, pyramid_, matches_, depth_, /*everywhere=*/false, matcher_, filter_,
               map_.in_use(), random_);
  if (KeepForAdjustment(*frame.camera)) {
    refiner_.Start(frames_, frame.capture_time_ns, map_, filter_);
  }
  KeepKeyframe(frame);
  CloseLoops(frame);
}

}  // namespace saccade
