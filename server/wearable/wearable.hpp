#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/anchors/annotation_book.hpp"
#include "server/anchors/pointer_placer.hpp"
#include "server/capture/frame_source.hpp"
#include "server/gaze/gaze_loop.hpp"
#include "server/pipeline/commands.hpp"
#include "server/pipeline/events.hpp"
#include "server/pipeline/frame_cost.hpp"
#include "server/tracker/frame_tracker.hpp"

namespace saccade {

/// What one frame came to.
struct WearableStep {
  std::shared_ptr<const Frame> frame;
  std::shared_ptr<const MapSnapshot> snapshot;
  std::vector<AnchorMoved> moved;  // anchors that jumped
  /// A stored map was brought back with this frame, and that is what its place looked like.
  std::shared_ptr<const SurfaceSnapshot> restored;
  FrameCost cost;  // of the tracker alone
};

/// One wearable without threads: a frame goes through tracker, frame ring and anchors, a command
/// changes annotations or the map. The server gives it a thread, an evaluation simulated time; what
/// is computed is the same.
///
/// One thread at a time, but for what says otherwise.
class Wearable {
 public:
  /// `journal` may be null: annotations are kept in memory alone, commands are answered before
  /// Execute returns. `wake` asks for a Settle() soon, on any thread. Where the source has a
  /// target, annotations belong to its world unless `anchors` names another. Errors as
  /// AnnotationBook::Open.
  static absl::StatusOr<std::unique_ptr<Wearable>> Create(
      const SourceInfo& source, std::unique_ptr<FrameTracker> tracker, AnchorOptions anchors,
      std::unique_ptr<AnnotationJournal> journal = nullptr, std::function<void()> wake = nullptr);

  /// What the place looks like, from the next frame on: clicks land on it.
  void SetSurface(std::shared_ptr<const SurfaceSnapshot> surface) { surface_ = std::move(surface); }

  /// Frames by rising capture time (see Tracker::Track). The result stays until the next Step.
  const WearableStep& Step(Frame frame);
  /// Carries a command out; it is answered once, when what it changed is kept.
  void Execute(Command command);
  /// Between frames: settles what the journal has kept, and recomputes the anchors of the newest
  /// frame, which commands may have changed.
  void Settle();

  /// Null before the first frame. Its snapshot is another one after ResetMap.
  const WearableStep* newest() const { return newest_ ? &*newest_ : nullptr; }
  /// What gaze control needs of the newest frame; there must be one. `angles`: of the head in it.
  GazeView View(const std::optional<MountAngles>& angles) const;
  FrameTracker& tracker() { return *tracker_; }
  /// FailedPrecondition: too little is mapped yet to come back to.
  absl::StatusOr<StoredWorld> Store() const;
  /// As FrameTracker::Resume; what was placed in that world is found again with it.
  absl::Status Resume(const StoredWorld& stored);

  /// Any thread.
  FrameRing& ring() { return ring_; }
  const PointerPlacer& pointers() const { return *pointers_; }
  /// Never null; empty after Close(). Any thread.
  std::shared_ptr<const AnnotationList> annotations() const;
  /// Waits until every change that was accepted is kept, at most `limit`. Any thread, also while
  /// Close() is at work.
  absl::Status Flush(std::chrono::milliseconds limit);
  /// Commits what is queued and gives every answer that is owed; only ring(), annotations() and
  /// Flush() may be called after it.
  void Close();

 private:
  Wearable(const SourceInfo& source, std::unique_ptr<FrameTracker> tracker);
  void ResetTracker(const ResetMap& command);

  const bool upright_;  // the target's frame is the world's, and knows where down is
  const std::unique_ptr<FrameTracker> tracker_;
  FrameRing ring_;
  std::unique_ptr<PointerPlacer> pointers_;
  std::unique_ptr<AnnotationBook> book_;      // the caller's thread, but for Latest()
  mutable std::timed_mutex book_gone_mutex_;  // held to throw book_ away, and to read it elsewhere
  std::optional<WearableStep> newest_;
  std::shared_ptr<const SurfaceSnapshot> surface_;  // null: none is known
  std::string world_;                               // UUID of the map's coordinates
  std::string resuming_;  // of the map that the tracker looks for, until the next frame
  std::shared_ptr<const SurfaceSnapshot> resuming_surface_;  // its, likewise
  std::optional<std::uint64_t> generation_;                  // that world_ is of
};

}  // namespace saccade
