#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/pipeline/replay.hpp"
#include "server/record/replayed_state.hpp"

namespace saccade {

/// Plays a recording to a sink as an engine would publish it, at its own pace. Seeking goes to the
/// picture before the wanted moment that needs no other; what was known then is told first. At its
/// end it stands still.
class Replayer final : public ReplayPort {
 public:
  /// DataLoss: no recording of saccade's, or nothing to be seen in it; Unimplemented: compressed.
  static absl::StatusOr<std::unique_ptr<Replayer>> Open(const std::filesystem::path& file);
  ~Replayer() override { Stop(); }

  /// Begins to play; `sink` lives until Stop.
  void Start(EventSink& sink);
  void Stop();
  /// The picture that is shown, once more, where it stands still. Any thread.
  void ShowAgain();

  std::shared_ptr<const CameraModel> camera() const { return camera_; }
  std::shared_ptr<const AnnotationList> annotations() const;
  std::shared_ptr<const GazeSnapshot> gaze() const;
  std::shared_ptr<const SurfaceSnapshot> surface() const;

  ReplayState replay() const override;
  void Change(const ReplayChange& change, Done<ReplayState> done) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::string topic, data;
    Timestamp time_ns = 0;
  };
  struct Order {
    ReplayChange change;
    Done<ReplayState> done;  // null: ShowAgain
  };

  Replayer(std::filesystem::path file, std::unique_ptr<McapReader> mcap)
      : file_(std::move(file)), mcap_(std::move(mcap)) {}
  void Run(std::stop_token stop);
  void Carry(const Order& order);
  absl::Status Seek(Timestamp wanted_ns);
  absl::StatusOr<Timestamp> KeyFrameBefore(Timestamp wanted_ns);
  absl::StatusOr<std::vector<Kept>> Between(Timestamp from_ns, Timestamp until_ns);
  absl::Status Fill();
  void TellNext();
  void SetTime(Clock::time_point now);
  /// When what was recorded at `time_ns` is due.
  Clock::time_point DueAt(Timestamp time_ns) const;
  void Anchor();
  void Publish();

  const std::filesystem::path file_;
  const std::unique_ptr<McapReader> mcap_;
  std::shared_ptr<const CameraModel> camera_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Order> orders_;
  ReplayState published_;
  std::shared_ptr<const AnnotationList> annotations_;
  std::shared_ptr<const GazeSnapshot> gaze_;
  std::shared_ptr<const SurfaceSnapshot> surface_;
  bool stopped_ = false;

  // The thread's.
  EventSink* sink_ = nullptr;
  ReplayedState state_;
  std::deque<Kept> next_;
  Timestamp read_until_ns_ = 0, position_ns_ = 0, anchor_ns_ = 0;
  Clock::time_point anchor_;
  double speed_ = 1.0;
  bool playing_ = true, ended_ = false;
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace saccade
