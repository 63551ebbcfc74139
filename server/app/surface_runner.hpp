#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "server/capture/frame.hpp"
#include "server/surface/surface_map.hpp"
#include "shared/scene/keyframe_places.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

struct SurfaceRunnerOptions {
  SurfaceOptions surface;
  double most_cores = 0.5;  // of its thread's time, in the mean; above 0, at most 1
  std::chrono::milliseconds publish_every{400};
};

/// Surfaces beside the tracker: one thread of low priority, which rests so long after each step
/// that it takes no more than its share. Keyframes that come faster than it works are passed over,
/// oldest first.
class SurfaceRunner {
 public:
  /// On the runner's thread; must not block.
  using Published = std::function<void(std::shared_ptr<const SurfaceSnapshot>)>;

  /// Errors as SurfaceMap::Create.
  static absl::StatusOr<std::unique_ptr<SurfaceRunner>> Create(const SurfaceRunnerOptions& options);
  ~SurfaceRunner() { Stop(); }

  void Start(Published published);
  void Stop();

  /// What the place of a map that was brought back looked like, as generation `before->generation`
  /// has it. The tracker's thread.
  void Restore(std::shared_ptr<const SurfaceSnapshot> before);
  /// The map of now: surfaces of another one are gone. The tracker's thread.
  void OnMap(std::uint64_t generation);
  /// After each frame that was tracked, on the tracker's thread: two pointers are compared.
  void OnFrame(const std::shared_ptr<const Frame>& frame,
               std::shared_ptr<const KeyframePlaces> places);

  /// Never null. Any thread.
  std::shared_ptr<const SurfaceSnapshot> newest() const;

 private:
  struct KeyframeSeen {
    std::shared_ptr<const Frame> frame;
    std::shared_ptr<const KeyframePlaces> places;
  };

  SurfaceRunner(const SurfaceRunnerOptions& options, std::unique_ptr<SurfaceMap> map);
  void Run(std::stop_token stop);
  void TakeNews();
  void Publish();
  void Rest(const std::stop_token& stop, double worked_ms);

  const SurfaceRunnerOptions options_;
  /// Added to editions: those of a server that ran before are other ones.
  const std::uint64_t first_edition_;
  Published published_;
  std::shared_ptr<const KeyframePlaces> last_places_;  // the tracker's thread
  std::uint64_t last_generation_ = 0;                  // likewise
  std::unique_ptr<SurfaceMap> map_;                    // the runner's thread
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<KeyframeSeen> seen_;
  std::shared_ptr<const KeyframePlaces> places_;     // null: as they were
  std::shared_ptr<const SurfaceSnapshot> restored_;  // null: nothing was
  std::shared_ptr<const SurfaceSnapshot> newest_;
  std::jthread thread_;
};

}  // namespace saccade
