#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/pipeline/recording.hpp"
#include "server/record/event_writer.hpp"
#include "server/record/recorded_stream.hpp"
#include "server/record/surface_rounds.hpp"

namespace saccade {

struct RecorderOptions {
  std::filesystem::path directory;
  std::uint64_t file_bytes = std::uint64_t{1} << 30;       // then another file
  std::chrono::seconds file_length{600};                   // likewise
  std::uint64_t keep_free_bytes = std::uint64_t{1} << 30;  // of the disk: for what matters more
  std::size_t queue_bytes = std::size_t{32} << 20;         // half a minute of ordinary video
  std::string version, source;
};

/// Records what the hub tells, into MCAP files of its directory (docs/design/recordings.md).
///
/// Takes part in the hub as a participant whom everybody sees, "recording": once for what goes on
/// (pictures, poses, conversation) and once for state, which begins anew every ten seconds, so that
/// a reader need not begin at the beginning. Events wait in a bounded queue for the one thread that
/// writes: neither tracker nor hub ever waits for the disk. Whatever is wrong with that ends the
/// recording, and is said; never the server.
class Recorder final : public RecordingPort {
 public:
  /// `hub` outlives it, and is connected.
  Recorder(StreamHub& hub, RecorderOptions options);
  ~Recorder() override { Stop(); }

  /// Finishes the file; what is asked for after it is refused.
  void Stop();

  RecordingState recording() const override;
  void StartRecording(Done<RecordingState> done) override;
  void StopRecording(Done<RecordingState> done) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Order {
    bool start = false;
    Done<RecordingState> done;
  };

  void Post(Order order);
  void Run(std::stop_token stop);
  void Carry(const Order& order);
  absl::Status Begin();
  void End(const absl::Status& why);
  absl::Status OpenFile();
  absl::Status CheckRoom() const;
  void OpenState();
  void OpenFlow();
  absl::Status Take(std::deque<RecordedEvent> events);
  absl::Status Attend(Clock::time_point now);
  /// Whether the next picture that can begin a file does.
  bool WantsNewFile(Clock::time_point now) const;
  void Publish();

  StreamHub& hub_;
  const RecorderOptions options_;
  const std::shared_ptr<RecordQueue> queue_;
  const Session flow_session_, state_session_;

  mutable std::mutex mutex_;
  RecordingState published_;
  std::deque<Order> orders_;
  bool stopped_ = false;

  // The thread's.
  RecordingState state_;
  std::unique_ptr<EventWriter> writer_;
  std::shared_ptr<RecordedStream> flow_, state_stream_;
  Clock::time_point opened_, flushed_, synced_, looked_, key_frame_, state_begun_;
  SurfaceRounds surface_;
  std::uint64_t bytes_before_ = 0, messages_before_ = 0;  // of finished files
  std::uint64_t lost_before_ = 0, lost_seen_ = 0;
  int files_ = 0;
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace saccade
