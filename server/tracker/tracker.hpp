#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <map>
#include <memory>
#include <random>

#include "server/capture/frame_source.hpp"
#include "server/map/map.hpp"
#include "server/map/relocaliser.hpp"
#include "server/tracker/advice.hpp"
#include "server/tracker/births.hpp"
#include "server/tracker/delayed_depths.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/frame_tracker.hpp"
#include "server/tracker/front_end.hpp"
#include "server/tracker/inertial_guide.hpp"
#include "server/tracker/lens_evidence.hpp"
#include "server/tracker/lens_learner.hpp"
#include "server/tracker/loop_closer.hpp"
#include "server/tracker/picture_rate.hpp"
#include "server/tracker/refiner.hpp"
#include "server/tracker/retirement.hpp"
#include "server/tracker/square_landmarks.hpp"
#include "server/tracker/start_finder.hpp"
#include "server/tracker/starter.hpp"
#include "server/tracker/status_monitor.hpp"
#include "server/tracker/suspension.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Follows one camera through a place that it maps at the same time (EKF SLAM).
///
/// Frame in, snapshot out; one thread at a time. Deterministic for one seed. Losing track is a
/// state of the snapshot, never an error.
class Tracker final : public FrameTracker {
 public:
  /// `source`: the camera (never null) and, if the place has one, its target and start pose.
  /// `front_end`: what answers for its frames; null: their pictures. `squares`: those that are
  /// measured beside natural features; null: none.
  /// InvalidArgument: options out of range, no camera, a target that cannot be used.
  static absl::StatusOr<std::unique_ptr<Tracker>> Create(
      const SourceInfo& source, const TrackerOptions& options,
      std::unique_ptr<FrontEnd> front_end = {}, std::unique_ptr<SquareLandmarks> squares = {});
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// Never null. Frames come in the order of their capture times; one that is not newer than the
  /// last, or not of the camera's size, changes nothing but the snapshot's frame id. After a gap of
  /// more than a second, or where the clock was set back by more, tracking starts anew: in the map,
  /// if it recognises it. The cost of a frame does not depend on the gap.
  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override;

  /// Of a source whose lens is assumed; the frames' own camera is not looked at then.
  std::shared_ptr<const CameraModel> lens() const override {
    return learner_ ? learner_->lens() : nullptr;
  }

  /// What is known of it; nothing: the lens was given.
  void SetSight(std::shared_ptr<const Sight> sight) override {
    if (squares_) squares_->SetSight(std::move(sight));
  }
  void SetCarried(std::shared_ptr<const CarriedSquareList> carried) override {
    if (squares_) squares_->SetCarried(std::move(carried));
  }
  SceneLight light() const override { return squares_ ? squares_->light() : SceneLight(); }
  std::optional<LensState> lens_state() const override {
    return learner_ ? std::optional(learner_->state()) : std::nullopt;
  }

  std::shared_ptr<const KeyframePlaces> keyframes() const override { return keyframe_places_; }

  /// Returns when nothing is being computed on other threads (for a process that forks).
  void WaitForBackground() const {
    refiner_.Wait();
    finder_.Wait();
    loops_.Wait();
    lens_evidence_.WaitForFit();
    if (learner_) learner_->Wait();
    if (squares_) squares_->Wait();
  }

  /// Throws the map away; the next frame starts anew (with the target, where there is one in view).
  void Reset() override;

  std::shared_ptr<const StoredMap> Store() const override;
  absl::Status Resume(std::shared_ptr<const StoredMap> map) override;

  /// Starts a feature at something seen in an earlier frame, typically clicked by an expert.
  ///
  /// `clicked_frame` [kept by the caller] with the pose that it was published with; `pixel` in it
  /// [px, distorted]; depth along the optical axis of that camera, mean and sigma [m]. The patch is
  /// looked for in the newest tracked frame; the feature starts there with that depth.
  ///   FailedPrecondition  not tracking, or the map is full of better features
  ///   InvalidArgument     pixel or depth not usable
  ///   NotFound            the patch is not seen in the newest frame, or has no texture
  absl::StatusOr<FeatureId> SeedFeature(const Frame& clicked_frame, const Rigid3& world_from_camera,
                                        const Eigen::Vector2d& pixel, double depth_prior_m,
                                        double depth_sigma_m) override;

  const TrackerOptions& options() const { return options_; }
  /// What it holds, as of the newest frame; for evaluation. Between two calls of Track() only.
  const FilterState& filter() const { return filter_; }
  const Map& map() const { return map_; }
  const FrameMatches& matches() const { return matches_; }
  /// Normalised innovation squared of the newest update: of all matches together; 0: none was.
  double nis() const { return nis_; }
  /// Null without squares.
  const SquareLandmarks* squares() const { return squares_.get(); }

 private:
  Tracker(const SourceInfo& source, const TrackerOptions& options,
          std::unique_ptr<FrontEnd> front_end, std::unique_ptr<SquareLandmarks> squares);
  std::shared_ptr<const MapSnapshot> TrackSeen(const Frame& frame);
  void Begin(const Frame& frame);
  /// Lost before there was a map that one could come back to.
  void StartAnew(const Frame& frame);
  /// Lost, and the map was seen too shortly to be found again, or is another place's: another one
  /// is worth more.
  bool Hopeless() const;
  void Follow(const Frame& frame, double dt);
  void Recover(const Frame& frame);
  /// Before the first frame after a gap in time (server/capture/gap.hpp): a map that can be
  /// recognised is looked for in that frame, and confirmed as after any loss; another starts anew.
  void ResumeAfterGap();
  bool Accept(const Relocalisation& found, const CameraModel& camera);
  void Revert();
  /// Predicts and searches; widens what is expected if the camera moved unexpectedly.
  void PredictAndSearch(const CameraModel& camera, double dt);
  void Correct(const CameraModel& camera);
  void Manage(const Frame& frame);
  /// Starts features where they are wanted; `everywhere`: the first ones.
  void Grow(const Frame& frame, bool everywhere);
  /// Errors are counted from where the camera is, not from where it once began (WantedHome).
  void MoveHome();
  MapMoment Now() const { return {frames_, home_, depth_.inverse_range}; }
  /// Takes landmarks at rest back that should be in view, where the filter has too few.
  void Wake(const CameraModel& camera);
  /// Of where a keyframe was, when its landmarks are woken.
  Matrix6d WakeCovariance(double distance_m) const;
  /// Keeps this frame as a keyframe of the map, if it has news; true if it had.
  bool KeepForAdjustment(const Frame& frame);
  void PublishAtRest(MapSnapshot& snapshot) const;
  void PublishKeyframes();
  OldLandmarks OldOnes() const;
  void CloseLoops(const Frame& frame);
  void MoveMap(const MapCorrection& correction);
  void KeepKeyframe(const Frame& frame);
  bool Settled() const;
  /// Without a target, until the pictures hold the scale: tries to find a start, and takes it over.
  void SeekStart(const Frame& frame);
  /// Whether a target in view is of more use to learn the lens from than to start with.
  bool StudiesLens();
  /// Tries to learn the lens; a better one is taken over by map, filter and this frame.
  void LearnLens(const Frame& frame);
  /// Filter, map and keyframes anew, from a start that holds; the camera from this frame's matches.
  void TakeOver(const FoundStart& start, const Frame& frame);
  // Squares (squares.cpp).
  /// Puts the camera where squares of known place say it is: their world is the map's.
  std::optional<Start> StartBySquares(const Frame& frame);
  bool WaitsForSquares() const;
  /// Squares in view are about to tell what a metre is: poses before would be in another unit.
  bool WaitsForMetre() const;
  void SearchSquares();
  /// Adds what was found; the pose to linearise at.
  Rigid3 AddSquares(std::vector<Observation>& observations);
  void StartSquares(const FoundStart& start);
  void ManageSquares(const Frame& frame);
  bool RecoverBySquares(const Frame& frame);
  /// The map becomes metric; `metre` in its units.
  void TakeMetre(double metre);
  // An inertial unit (inertial.cpp).
  /// It carries the camera from frame to frame: the map is in metres, gravity and biases are known.
  bool Carried() const;
  /// Whether it carries the camera to `frame` over a gap that would otherwise be a loss.
  bool Bridges(const Frame& frame);
  /// False: it does not carry the camera, nothing is done.
  bool PredictByUnit(double dt, const MotionNoise& noise);
  /// A frame that shows nothing new: the camera is where the unit says.
  void Coast(double dt);
  /// The same of a frame in which too little was found; false: it counts as any other.
  bool CoastsBlind(double dt);
  /// It is about to tell what a metre is: poses before would be in another unit.
  bool WaitsForUnit() const;
  void SeekUnit(const Frame& frame);
  int SquaresAttempted() const { return squares_ ? squares_->attempted() : 0; }
  int SquaresFound() const { return squares_ ? static_cast<int>(squares_->found().size()) : 0; }
  std::optional<double> MovedPx(const CameraModel& camera, double dt) const;
  Difficulties SeeDifficulties() const;
  std::shared_ptr<const MapSnapshot> Publish(const Frame& frame, const StageTimes& times);

  SourceInfo source_;
  TrackerOptions options_;
  std::unique_ptr<FrontEnd> front_end_;  // has last_frame_
  std::mt19937_64 random_;
  FilterState filter_;
  Map map_;
  FrameMatcher matcher_;
  Births births_;
  DelayedDepths delayed_;  // with options_.classic
  const Retirement retirement_;
  Starter starter_;
  StatusMonitor monitor_;
  LensEvidence lens_evidence_{LensEvidenceOptions()};  // the source's, as the rate is
  std::unique_ptr<LensLearner> learner_;               // null: the lens was given
  bool lens_told_ = false;                             // in the log
  PictureRate rate_;  // the source's: a new map changes nothing about it
  Relocaliser relocaliser_;
  Refiner refiner_;
  StartFinder finder_;
  LoopCloser loops_;  // reads relocaliser_

  Frame last_frame_;                           // newest that was tracked
  std::optional<MountAngles> previous_mount_;  // of the frame before it
  bool has_frame_ = false;
  int repeated_ = 0;  // times that the newest picture came again
  bool started_ = false;
  bool metric_ = false;
  bool held_ = false;  // the map's scale is: by a target, or by what was seen from different places
  Suspension suspension_;
  bool suspended_ = false;  // the head turns too fast for this frame to be searched
  Births::DepthGuess depth_;
  std::int64_t frames_ = 0;  // since the start of this map
  std::int64_t frames_lost_ = 0;
  std::int64_t frames_tracked_ = 0;  // of this map
  std::uint64_t revision_ = 0;
  CloneId home_ = 1;  // clone that errors are counted from; at first where the map began
  std::uint64_t generation_ = 0;
  FrameMatches matches_;
  double nis_ = 0.0;
  StageTimes times_;
  std::optional<Map::Checkpoint> before_relocalisation_;
  std::map<KeyframeId, FrameId> keyframe_frames_;  // of this run
  std::shared_ptr<const KeyframePlaces> keyframe_places_;
  std::uint64_t keyframe_changes_ = 0;    // of the graph, that they are of
  std::unique_ptr<InertialGuide> guide_;  // null: no inertial unit, or none is wanted
  double blind_s_ = 0.0;                  // since something was seen
  std::unique_ptr<SquareLandmarks> squares_;
  int waited_for_squares_ = 0;  // frames
  /// Of the first frame in which a stored map was looked for; it was not found yet.
  std::optional<Timestamp> resuming_since_ns_;
  bool resuming_ = false;
  bool in_squares_world_ = false;  // the map's world is that of the known squares
};

}  // namespace saccade
