#pragma once

#include <atomic>
#include <future>
#include <optional>
#include <unordered_map>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/map/place_graph.hpp"
#include "server/map/relocaliser.hpp"
#include "server/tracker/loop_evidence.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// What the tracker knows after a frame that was tracked.
struct LoopView {
  std::int64_t frame_number = 0;
  const Frame& frame;
  const ImagePyramid& pyramid;
  const FilterState& filter;
  const FrameMatches& matches;
  const KeyframeGraph& graph;
  const OldLandmarks& old;    // only where WantsOld()
  KeyframeId rigid_from = 0;  // the oldest that the filter still measures; the same
};

/// Finds out that the camera is back at a place whose landmarks the ordinary search would miss, and
/// how the map has to move for its old part to meet the new one.
///
/// Twice a second the relocaliser is asked, on a thread of its own, whether the picture shows old
/// landmarks. If so, and they are further from where they should be than a search reaches, the next
/// frames have to prove it, each by itself, while the camera moves (LoopSight); then the pose graph
/// is adjusted on that thread. Results are taken a fixed number of frames later, waited for if need
/// be; live when they are there. All calls from the tracker's thread.
class LoopCloser {
 public:
  LoopCloser(const TrackerOptions& options, const Relocaliser& relocaliser);
  ~LoopCloser();
  LoopCloser(const LoopCloser&) = delete;
  LoopCloser& operator=(const LoopCloser&) = delete;

  /// The camera was lost, or the map thrown away: whatever is going on is dropped.
  void Reset();
  void Wait() const;
  /// The relocaliser is being read by another thread: it must not be changed.
  bool ReadsRelocaliser() const { return query_.valid(); }
  /// Whether the next Step() looks at `LoopView::old`.
  bool WantsOld(std::int64_t frame_number) const;
  /// One frame's worth. A correction once a loop has been closed; the caller applies it at once.
  std::optional<MapCorrection> Step(const LoopView& view);
  /// What Step() has waited in this frame [ms].
  double waited_ms() const { return waited_ms_; }

 private:
  struct Candidate {
    Similarity3 old_from_present;
    std::vector<LoopSight> sights;
    int failed = 0;
    std::int64_t next_look = 0;
  };

  void Stop();
  void StartQuery(const LoopView& view);
  void TakeQuery(const LoopView& view);
  void Look(const LoopView& view);
  void StartSolving(const LoopView& view, const LoopAgreement& agreement);
  bool Due(std::int64_t frame_number) const;
  /// Whether the tracker can have drifted so far on the way since it left the old place.
  bool Plausible(const Relocalisation& found) const;
  void BookWay(const LoopView& view);

  TrackerOptions options_;
  const Relocaliser& relocaliser_;
  std::atomic<bool> stop_ = false;
  std::future<std::optional<Relocalisation>> query_;
  std::future<std::optional<MapCorrection>> solving_;
  std::optional<Candidate> candidate_;
  std::unordered_map<FeatureId, std::int64_t> last_met_;  // frames, of what was asked for
  Rigid3 query_pose_;                                     // the filter's, of the queried picture
  std::int64_t started_ = 0;                              // frame of the query or the solving
  std::int64_t pause_until_ = 0;
  double waited_ms_ = 0.0;
  std::optional<Rigid3> last_pose_;
  double way_m_ = 0.0;             // of the camera so far
  std::vector<double> way_after_;  // of every 30th frame
};

}  // namespace saccade
