#pragma once

#include <atomic>
#include <future>
#include <optional>
#include <vector>

#include "server/filter/filter_state.hpp"
#include "server/map/keyframe_graph.hpp"
#include "server/map/start_adjustment.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A start that holds, ready for filter and keyframe graph.
struct FoundStart {
  struct Keyframe {
    Timestamp time_ns = 0;
    Rigid3 world_from_camera;
    std::vector<GraphSighting> sightings;
    std::vector<GraphBirth> births;
    int anchor = -1;  // index into seed.clones; -1: nothing in the filter hangs on it
  };
  MapSeed seed;
  std::vector<Keyframe> keyframes;  // in order of time
  Rigid3 newest;                    // the newest keyframe's camera
  Rigid3 newest_before;             // the same as the filter had it
  Timestamp newest_time_ns = 0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // there [unit/s]
  double inverse_range = 1.0;                          // median [1/unit]
  StartEvidence evidence;
};

/// Waits, where there is no target, until the pictures hold the scale: then all frames since the
/// beginning are solved as one problem (slam-spec 7; server/map/start_adjustment).
///
/// The tracker's thread calls; the solving runs on another and sees a copy. As with adjustment, a
/// result is taken `adjust_delay` frames later, waited for if need be (offline) or when it is
/// there.
class StartFinder {
 public:
  explicit StartFinder(const TrackerOptions& options) : options_(options) {}
  ~StartFinder() { Stop(); }
  StartFinder(const StartFinder&) = delete;
  StartFinder& operator=(const StartFinder&) = delete;

  void Reset();
  /// Remembers what this frame saw, after its births.
  void Record(Timestamp time_ns, const CameraModel& camera, const FilterState& filter,
              const LandmarkMap& map, const FrameMatches& matches);
  /// Begins to solve, if there is enough parallax to try and nothing is being solved.
  void Start(std::int64_t frame, const FilterState& filter);
  /// A start with evidence enough; nothing: not yet.
  std::optional<FoundStart> Finish(std::int64_t frame);
  void Wait() const;
  /// What Finish() has waited in this frame [ms].
  double waited_ms() const { return waited_ms_; }

 private:
  struct Seen {
    FeatureId id = 0;
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 3, 2> d_bearing;
    double late = 0.0;  // of the row after mid-exposure, in read-outs
    StartRay ray;
  };
  struct Shot {
    Timestamp time_ns = 0;
    Rigid3 world_from_camera;             // by the filter
    std::vector<Seen> sightings, births;  // rising ids
    Seen* Find(FeatureId id);             // in either
  };
  struct Job {
    StartProblem problem;
    std::vector<std::size_t> shots;
    std::vector<FeatureId> points;  // rising
  };

  static std::optional<Seen> See(const CameraModel& camera, FeatureId id,
                                 const Eigen::Vector2d& pixel, double sigma_px);
  static const Seen* Find(const std::vector<Seen>& seen, FeatureId id);
  void Stop();
  void Thin();
  /// How fast what was seen moved in the picture, as soon as other frames tell it: by differences
  /// of the newest three. At a birth and in the first frames nothing else knows it.
  void TellRates();
  bool ShowsParallax() const;
  Job MakeJob(const FilterState& filter) const;
  std::vector<std::size_t> ChooseShots() const;
  bool Holds(const StartEvidence& evidence) const;
  FoundStart Read(const StartSolution& solution) const;
  FoundStart::Keyframe ReadKeyframe(std::size_t keyframe, const StartSolution& solution,
                                    FoundStart& start) const;

  TrackerOptions options_;
  std::vector<Shot> shots_;
  FeatureId newest_feature_ = 0;
  std::atomic<bool> stop_ = false;
  std::future<std::optional<StartSolution>> running_;
  Job job_;                   // that is running, or was last
  std::int64_t started_ = 0;  // frame
  double waited_ms_ = 0.0;
};

}  // namespace saccade
