#pragma once

#include <atomic>
#include <future>
#include <map>
#include <optional>
#include <span>

#include "server/filter/filter_state.hpp"
#include "server/map/keyframe_graph.hpp"
#include "server/map/place_graph.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Bundle adjustment beside the filter: keyframes are remembered, adjusted on another core, and
/// what comes out is put into the filter a fixed number of frames later.
///
/// All calls from the tracker's thread; the adjustment itself runs on one of its own and sees a
/// copy. A result is taken `adjust_delay` frames after its start; if it is not there yet, the
/// offline evaluation waits for it (results repeat to the bit), the live server looks again in the
/// next frame.
class Refiner {
 public:
  explicit Refiner(const TrackerOptions& options);
  ~Refiner();
  Refiner(const Refiner&) = delete;
  Refiner& operator=(const Refiner&) = delete;

  /// Forgets everything; a running adjustment is stopped and dropped.
  void Reset();
  /// Drops a running adjustment: the camera was lost.
  void Drop(FilterState& filter);
  /// Remembers this frame, after its births and before anything else happens to the filter, if
  /// features were born in it or the camera has moved enough.
  void Keep(const CameraModel& camera, const FilterState& filter, const FrameMatches& matches,
            double inverse_range, const KeyframeGraph::LifeOf& life);
  /// Remembers a keyframe of a start that was solved elsewhere, and the clone that stands for it.
  void Take(const Rigid3& world_from_camera, double distance, std::span<const GraphSighting> seen,
            std::span<const GraphBirth> births, std::optional<AnchorPoseId> clone);
  /// Starts an adjustment if there is something new and none is running.
  void Start(std::int64_t frame, Timestamp time_ns, FilterState& filter);
  /// Puts a finished one into the filter. True: the camera jumped by it, seen against the distance
  /// to what is in view.
  bool Finish(std::int64_t frame, Timestamp time_ns, double inverse_range, FilterState& filter);
  /// What the keyframes know of a feature that has left the filter.
  std::optional<KeyframeGraph::Remembered> Remember(FeatureId id) const {
    return graph_.Remember(id);
  }
  /// A feature is about to leave the filter.
  void Rest(FeatureId id, const FilterState& filter);
  /// The clone that stands for a keyframe, put into the filter anew if it has left.
  AnchorPoseId CloneOf(KeyframeId id, const Matrix6d& covariance, FilterState& filter);
  /// The filter was put back to what it was: clones since then are unknown again.
  void ForgetClones(const FilterState& filter);
  const KeyframeGraph& graph() const { return graph_; }
  /// Moves the keyframes, and the filter with the newest of them; a running adjustment is dropped.
  void Move(const MapCorrection& correction, FilterState& filter);
  /// Returns when no adjustment is being computed any more.
  void Wait() const;
  /// What Finish() has waited in this frame [ms].
  double waited_ms() const { return waited_ms_; }

 private:
  void Stop();
  void Put(const KeyframeGraph::Job& job, FilterState& filter);

  TrackerOptions options_;
  KeyframeGraph graph_;
  std::map<KeyframeId, AnchorPoseId> clones_;
  FeatureId newest_feature_ = 0;  // that is known here
  std::atomic<bool> stop_ = false;
  std::future<std::optional<KeyframeGraph::Job>> running_;
  std::int64_t started_ = 0;  // frame
  Timestamp started_ns_ = 0;
  double waited_ms_ = 0.0;
  bool fresh_ = false;  // the newest keyframe is the newest frame
};

}  // namespace saccade
