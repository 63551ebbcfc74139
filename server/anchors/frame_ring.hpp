#pragma once

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "server/anchors/packed_frame.hpp"
#include "server/anchors/packed_snapshot.hpp"
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
///
/// All but the newest are kept packed (packed_frame.hpp, packed_snapshot.hpp): grey picture and
/// snapshot without loss, colour as fine as video has it. A thread of the ring's own packs them.
class FrameRing {
 public:
  struct Options {
    double duration_s = 10.0;
    /// Above this, the oldest frames first lose their colour, then go. 10 s of 640x480 at 30 Hz
    /// with colour take 75 MB.
    std::size_t max_bytes = std::size_t{160} << 20;
    std::size_t max_held = 16;
    std::size_t max_unpacked = 4;  // the newest frames, which most ask for
  };
  enum class Want { kAll, kGrey, kPose };  // kPose: a picture only where it costs nothing

  FrameRing() = default;
  explicit FrameRing(const Options& options) : options_(options) {}

  /// Adds the newest frame; ids rise. Waits (2 ms a frame) while six frames wait
  /// to be packed, which only a source faster than any camera brings about. A frame that is not
  /// newer than the last one (a source that started again) empties the ring first.
  void Push(PastFrame past);

  /// NotFound: the id is too old, was dropped, or has not been captured yet; the message says
  /// which. Unpacking takes 1 ms, 3 ms with colour (640x480), little without
  /// a picture.
  absl::StatusOr<PastFrame> Find(FrameId id, Want want = Want::kAll) const;

  /// The newest frame, or NotFound before the first.
  absl::StatusOr<PastFrame> Newest() const;

  /// Keeps this frame when its time is over; the one held longest ago goes for it. 2 ms.
  /// Without memory for it, it is not held.
  void Hold(const PastFrame& past);

  /// Waits until all that should be packed is (for tests and measurements).
  void WaitUntilPacked() const;
  /// Of the pictures and snapshots kept, those held not counted.
  std::size_t bytes() const;

 private:
  struct Packed {
    PackedFrame frame;
    PackedSnapshot snapshot;
    PastFrame Unpack(Want want) const;
  };
  /// Either as it came or packed.
  struct Entry {
    FrameId id = 0;
    Timestamp time_ns = 0;
    PastFrame whole;
    std::shared_ptr<const Packed> packed;
    std::size_t bytes = 0;
    bool old = false;  // in a copy: to be answered as packed
  };

  /// Null: no memory.
  static std::shared_ptr<const Packed> PackOne(const PastFrame& past, const PackedSnapshot* before);
  void Trim();
  void DropColor(Entry& entry);
  bool MayPack() const { return packed_ + options_.max_unpacked < frames_.size(); }
  void PackOld(const std::stop_token& stop);
  absl::StatusOr<Entry> Locate(FrameId id) const;

  Options options_;
  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  std::deque<Entry> frames_;                        // by rising id
  std::deque<std::shared_ptr<const Packed>> held_;  // newest last
  std::size_t bytes_ = 0;
  std::size_t packed_ = 0;        // frames before this index are packed
  std::size_t colored_from_ = 0;  // frames before this index have lost their colour
  std::jthread packer_;           // last: uses everything above; starts with the first frame
};

}  // namespace saccade
