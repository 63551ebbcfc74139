#include "server/tracker/tracker.hpp"

#include "server/capture/gap.hpp"
#include "server/pipeline/stop_watch.hpp"
#include "server/tracker/encoder_motion.hpp"
#include "server/tracker/home.hpp"
#include "server/tracker/picture_front_end.hpp"
#include "server/tracker/settling.hpp"
#include "server/tracker/surprise.hpp"
#include "server/tracker/target_expiry.hpp"

namespace saccade {
namespace {

constexpr int kFewestToUpdate = 3;  // matches: fewer can agree by chance
constexpr int kRepeats = 2;         // of a picture, as a source does that fills up its rate
constexpr int kYoungMap = 60;       // frames tracked in it, before it is worth waiting for
constexpr int kPatience = 30;       // frames lost, before a young map is given up

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

absl::StatusOr<std::unique_ptr<Tracker>> Tracker::Create(const SourceInfo& source,
                                                         const TrackerOptions& options,
                                                         std::unique_ptr<FrontEnd> front_end,
                                                         std::unique_ptr<SquareLandmarks> squares) {
  if (const absl::Status status = options.Validate(); !status.ok()) return status;
  if (const absl::Status status = Starter::Check(source); !status.ok()) return status;
  if (!front_end) front_end = std::make_unique<PictureFrontEnd>(source.camera, options);
  if (const absl::Status status = front_end->Check(source); !status.ok()) return status;
  return std::unique_ptr<Tracker>(
      new Tracker(source, options, std::move(front_end), std::move(squares)));
}

Tracker::Tracker(const SourceInfo& source, const TrackerOptions& options,
                 std::unique_ptr<FrontEnd> front_end, std::unique_ptr<SquareLandmarks> squares)
    : source_(source),
      options_(options),
      front_end_(std::move(front_end)),
      random_(options.seed),
      filter_(MakeFilterOptions(options, *source.camera)),
      matcher_(options),
      births_(options),
      retirement_(options),
      starter_(source, options),
      monitor_(options),
      relocaliser_(MakeRelocaliserOptions(options)),
      refiner_(options),
      finder_(options),
      loops_(options, relocaliser_),
      suspension_(options.suspend_rate_rad_s),
      squares_(std::move(squares)) {
  if (source.lens_assumed && options.learn_lens) {
    learner_ = std::make_unique<LensLearner>(options, source.camera);
  }
  // Where joints turn the camera, nobody knows on which side of them the unit is.
  if (source.imu != nullptr && options.inertial && !source.mount) {
    guide_ = std::make_unique<InertialGuide>(source.imu, InertialGuideOptions());
  }
}

void Tracker::Reset() {
  loops_.Reset();
  filter_.Reset(CameraMotion(), Matrix12d::Zero());
  map_.Clear();
  births_.Reset();
  delayed_.Reset();
  starter_.Reset();
  monitor_.Reset();
  relocaliser_.Clear();
  refiner_.Reset();
  finder_.Reset();
  lens_evidence_.ForgetViews();
  if (learner_) learner_->Reset();
  matches_ = FrameMatches();
  before_relocalisation_.reset();
  keyframe_frames_.clear();
  started_ = metric_ = held_ = has_frame_ = false;
  if (squares_) squares_->Reset();
  if (guide_) guide_->Reset();
  blind_s_ = 0.0;
  in_squares_world_ = resuming_ = false;
  resuming_since_ns_.reset();
  waited_for_squares_ = 0;
  suspension_.Forget();
  frames_ = frames_lost_ = frames_tracked_ = 0;
  home_ = 1;
  ++generation_;
  ++revision_;
}

void Tracker::StartAnew(const Frame& frame) {
  Reset();
  last_frame_ = frame;
  has_frame_ = true;
  Begin(frame);
}

bool Tracker::Hopeless() const {
  if (!held_) return true;
  if (resuming_) {
    return resuming_since_ns_ &&
           Seconds(last_frame_.capture_time_ns - *resuming_since_ns_) > options_.resume_patience_s;
  }
  return !metric_ && frames_tracked_ < kYoungMap && frames_lost_ > kPatience;
}

std::shared_ptr<const MapSnapshot> Tracker::Track(const Frame& frame) {
  if (!learner_ || !frame.camera) return TrackSeen(frame);
  Frame seen = frame;
  seen.camera = learner_->lens();
  return TrackSeen(seen);
}

std::shared_ptr<const MapSnapshot> Tracker::TrackSeen(const Frame& frame) {
  StopWatch total;
  times_ = StageTimes();
  const double dt = has_frame_ ? Seconds(frame.capture_time_ns - last_frame_.capture_time_ns) : 0.0;
  const bool gap =
      has_frame_ && IsGap(last_frame_.capture_time_ns, frame.capture_time_ns) && !Bridges(frame);
  if (has_frame_ && dt <= 0.0 && !gap) return Publish(frame, times_);
  // One picture again is no measurement: what moves meanwhile is a gap when the next one comes.
  const bool repeats = has_frame_ && !gap && front_end_->Repeats(frame);
  const bool coasts = repeats && Bridges(frame);
  if (repeats && !coasts) {
    if (started_ && ++repeated_ > kRepeats) monitor_.Suspend();
    return Publish(frame, times_);
  }
  if (!front_end_->Take(frame)) return Publish(frame, times_);
  repeated_ = 0;
  if (has_frame_) rate_.Add(dt);
  if (gap) ResumeAfterGap();
  previous_mount_ = has_frame_ ? last_frame_.mount : std::nullopt;
  last_frame_ = frame;
  if (coasts) {
    Coast(dt);
    return Publish(frame, times_);
  }
  if (last_frame_.mount && !ToVector(*last_frame_.mount).allFinite()) last_frame_.mount.reset();
  has_frame_ = true;
  if (squares_) {
    squares_->Look(frame, !started_ || monitor_.status() == TrackingStatus::kLost);
    times_.waited_ms = squares_->waited_ms();
  }
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
  if (resuming_ && !resuming_since_ns_) resuming_since_ns_ = frame.capture_time_ns;
  if (monitor_.status() == TrackingStatus::kTracking) {
    ++frames_tracked_;
    resuming_ = false;
  }
  times_.total_ms = total.Lap_ms() - times_.waited_ms;
  return Publish(frame, times_);
}

bool Tracker::Settled() const {
  if (!held_ || WaitsForMetre() || WaitsForUnit()) return false;
  return options_.start || metric_ || monitor_.status() != TrackingStatus::kInitialising ||
         HasSettled(matches_, filter_, frames_, SettlingOptions());
}

void Tracker::PredictAndSearch(const CameraModel& camera, double dt) {
  StopWatch watch;
  MotionNoise noise{options_.acceleration_sigma_m_s2, options_.angular_acceleration_sigma_rad_s2};
  const MotionNoise agile = noise;
  std::optional<HeadMotion> head;
  if (options_.encoders && source_.mount && previous_mount_ && last_frame_.mount) {
    head = EncoderMotion(*source_.mount, *previous_mount_, *last_frame_.mount, dt, metric_);
    noise = {options_.worn_acceleration_sigma_m_s2,
             options_.worn_angular_acceleration_sigma_rad_s2};
  }
  const CameraMotion before = filter_.camera();
  const int accepted_before = matches_.accepted;
  if (!PredictByUnit(dt, noise)) filter_.Predict(dt, noise, head ? &*head : nullptr);
  suspended_ = suspension_.Suspends(head ? &*head : nullptr, dt);
  if (!suspended_) Wake(camera);
  times_.predict_ms = watch.Lap_ms();
  if (suspended_) {
    matches_ = FrameMatches();
    if (squares_) squares_->ForgetSearch();
    return;
  }
  matches_ = matcher_.Match(*front_end_, camera, filter_, map_.in_use(), {dt, noise}, random_);
  if (!Carried() && IsWorthWidening(matches_, accepted_before, options_.coasting_below)) {
    WidenAfterSurprise(before, dt, agile, SurpriseOptions(), filter_);
    const double searched_px2 = matches_.searched_px2;
    matches_ = matcher_.Match(*front_end_, camera, filter_, map_.in_use(), {dt, noise}, random_);
    matches_.searched_px2 += searched_px2;
  }
  if (squares_) SearchSquares();
  times_.search_ms = watch.Lap_ms();
}

void Tracker::Correct(const CameraModel& camera) {
  StopWatch watch;
  nis_ = 0.0;
  std::vector<Observation> observations;
  if (matches_.accepted >= (Carried() ? options_.coasting_below : kFewestToUpdate)) {
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
  }
  const Rigid3 at = SquaresFound() > 0 ? AddSquares(observations) : matches_.pose.world_from_camera;
  if (!observations.empty()) {
    const auto report = filter_.Update(camera, observations, at);
    if (!report.ok()) {
      matches_.accepted = 0;
      if (squares_) squares_->ForgetSearch();
    }
    nis_ = report.ok() ? report->nis : 0.0;
  }
  times_.update_ms = watch.Lap_ms();
}

void Tracker::Follow(const Frame& frame, double dt) {
  ++frames_;
  PredictAndSearch(*frame.camera, dt);
  if (suspended_) {
    monitor_.Suspend();
    return;
  }
  Correct(*frame.camera);
  StopWatch watch;
  const double waited_before_ms = times_.waited_ms;
  rate_.Record(matches_.attempted, matches_.accepted, MovedPx(*frame.camera, dt));
  if (!CoastsBlind(dt)) {
    monitor_.Record(matches_.attempted + SquaresAttempted(), matches_.accepted + SquaresFound(),
                    Settled());
  }
  const bool confirmed = monitor_.status() == TrackingStatus::kTracking ||
                         monitor_.status() == TrackingStatus::kInitialising;
  if (monitor_.refused()) {
    Revert();
  } else if (confirmed) {
    before_relocalisation_.reset();
    if (held_ && !learner_) lens_evidence_.Add(*frame.camera, filter_, matches_);
    Manage(frame);
    if (held_ && learner_) LearnLens(frame);
    if (squares_) ManageSquares(frame);
    SeekUnit(frame);
  }
  times_.manage_ms = watch.Lap_ms() - (times_.waited_ms - waited_before_ms);
}

/// How far things moved in the picture since the one before, about; nothing: too little was found.
std::optional<double> Tracker::MovedPx(const CameraModel& camera, double dt) const {
  if (matches_.accepted < options_.coasting_below) return std::nullopt;
  const double rate = matches_.motion.angular_velocity_rad_s.norm() +
                      matches_.motion.velocity_m_s.norm() * depth_.inverse_range;
  return dt * rate * camera.intrinsics().fx;
}

void Tracker::Grow(const Frame& frame, bool everywhere) {
  const auto& landmarks = map_.in_use().all();
  const FeatureId before = landmarks.empty() ? 0 : landmarks.back().id;
  births_.Grow(frame, matches_, depth_, everywhere, matcher_, *front_end_, filter_, map_.in_use(),
               random_);
  if (!options_.classic || !held_ || (everywhere && !metric_)) return;
  delayed_.Adopt(before + 1, metric_ ? 1.0 : 1.0 / depth_.inverse_range, map_);
}

void Tracker::MoveHome() {
  const auto wanted = WantedHome(matches_, filter_, home_, {.least_share = options_.home_share});
  if (wanted && filter_.CountErrorsFrom(*wanted)) home_ = *wanted;
}

void Tracker::Manage(const Frame& frame) {
  // A frame in which hardly anything was found says nothing about single features.
  const bool telling = matches_.accepted >= 0.3 * matches_.attempted;
  for (const LandmarkMatch& match : matches_.in_view) {
    Landmark& landmark = *map_.in_use().Find(match.id);
    landmark.last_in_view_frame = frames_;
    if (!match.searched || (!telling && !match.accepted())) continue;
    landmark.Record(match.accepted(), frames_);
  }
  if (starter_.TargetExpired(frames_) && matches_.accepted > 0) {
    LetTargetGo(frame, matcher_, *front_end_, births_, matches_, map_, filter_);
  }
  retirement_.Apply(Now(), map_, filter_);
  delayed_.Step(*frame.camera, matches_, matcher_, *front_end_, map_, filter_);
  // With most of the view covered the little that is left is no place to start features from: it
  // would be lost when the cover goes (T46).
  const bool covered = matches_.hidden > matches_.attempted;
  if (!held_) {
    if (telling && !covered) {
      Grow(frame, /*everywhere=*/false);
    }
    SeekStart(frame);
    return;
  }
  MoveHome();
  if (refiner_.Finish(frames_, frame.capture_time_ns, depth_.inverse_range, map_, filter_)) {
    ++revision_;
  }
  times_.waited_ms += refiner_.waited_ms();
  if (!telling || covered) return;
  if (const auto guess = Births::GuessDepth(filter_, matches_)) depth_ = *guess;
  Grow(frame, /*everywhere=*/false);
  if (KeepForAdjustment(frame)) {
    refiner_.Start(frames_, frame.capture_time_ns, map_, filter_);
  }
  KeepKeyframe(frame);
  CloseLoops(frame);
}

}  // namespace saccade
