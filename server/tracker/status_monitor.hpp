#pragma once

#include <deque>

#include "server/tracker/tracker_options.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Decides from the matches of each frame how tracking is (slam-spec section 2).
class StatusMonitor {
 public:
  explicit StatusMonitor(const TrackerOptions& options) : options_(options) {}

  /// Back to the start.
  void Reset();
  /// A frame without a map yet.
  void WaitForStart() { status_ = TrackingStatus::kInitialising; }
  /// The outcome of one frame that was searched. `settled`: the map's depths are known well enough
  /// to publish poses; until then the status is initialising.
  void Record(int attempted, int accepted, bool settled);
  /// A frame that was not searched, because the head turns too fast for it to show anything: its
  /// encoders carry the pose. It counts neither for nor against; after 2 s of these, as blind.
  void Suspend();
  /// Nobody knows where the camera is: a gap in time, say.
  void Lose();
  /// A frame that showed too little, of a camera that something else carries.
  void Coast();
  /// Tracking was lost, and now the camera may be found again: three frames must confirm it.
  void BeginRelocalisation();

  TrackingStatus status() const { return status_; }
  TrackingQuality quality() const { return quality_; }
  /// True if the newest frame was not searched.
  bool suspended() const { return suspended_in_row_ > 0; }
  /// True if a relocalisation was refused by the frames after it.
  bool refused() const { return refused_; }
  /// Part of attempted searches that succeeded over the last 10 frames; 1 if none was attempted.
  double ratio() const;

 private:
  void Confirm(int attempted, int accepted);
  void Count(int attempted, int accepted, bool settled);
  bool Believe(int attempted, int accepted);

  TrackerOptions options_;
  TrackingStatus status_ = TrackingStatus::kInitialising;
  TrackingQuality quality_ = TrackingQuality::kUnknown;
  struct Counts {
    int attempted, accepted;
  };
  std::deque<Counts> window_;
  int bad_in_row_ = 0;
  int blind_in_row_ = 0;
  int unconvinced_ = 0;  // frames that must agree before a pose is believed again
  int doubtful_in_row_ = 0;
  int suspended_in_row_ = 0;
  int confirming_ = 0;  // frames left
  int confirmed_ = 0;
  bool refused_ = false;
};

}  // namespace saccade
