#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include "server/capture/frame.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// A past frame together with what the tracker knew after it.
struct PastFrame {
  std::shared_ptr<const Frame> frame;
  std::shared_ptr<const MapSnapshot> snapshot;
};

/// Finds the frame that an expert saw. NotFound, with the remedy, if it is too old or unknown.
using FrameLookup = std::function<absl::StatusOr<PastFrame>(FrameId)>;

/// The last 10 s of frames by id: what a click on delayed video is resolved against, and where
/// GetFrame takes stills from. A still that somebody has fetched stays, to be clicked for as long
/// as he looks at it: the last 16 of them, colour and all. Any thread.
class FrameRing {
 public:
  struct Options {
    double duration_s = 10.0;
    /// Above this, the oldest frames first lose their colour, then go. 640x480 at 30 Hz with colour
    /// fills it in about 8 s.
    std::size_t max_bytes = std::size_t{300} << 20;
    std::size_t max_held = 16;
  };

  FrameRing() = default;
  explicit FrameRing(const Options& options) : options_(options) {}

  /// Adds the newest frame; ids rise. A frame that is not newer than the last one (a source that
  /// started again) empties the ring first.
  void Push(PastFrame past);

  /// NotFound: the id is too old, was dropped, or has not been captured yet; the message says
  /// which.
  absl::StatusOr<PastFrame> Find(FrameId id) const;

  /// The newest frame, or NotFound before the first.
  absl::StatusOr<PastFrame> Newest() const;

  /// Keeps this frame when its time is over; the one held longest ago goes for it.
  void Hold(const PastFrame& past);

 private:
  void Trim();

  Options options_;
  mutable std::mutex mutex_;
  std::deque<PastFrame> frames_;  // by rising id
  std::deque<PastFrame> held_;    // newest last
  std::size_t bytes_ = 0;
  std::size_t colored_from_ = 0;  // frames before this index have lost their colour
};

}  // namespace saccade
