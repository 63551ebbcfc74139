#pragma once

#include <cstdint>
#include <string>

#include "server/pipeline/commands.hpp"

namespace saccade {

/// What is being recorded, or was last.
struct RecordingState {
  bool on = false;
  std::string file;                // the newest; empty: none since the start
  std::int64_t since_unix_ns = 0;  // 0: never
  std::uint64_t bytes = 0;         // of all files since then
  std::uint64_t messages = 0;
  std::uint64_t events_lost = 0;  // because the disk was too slow
  std::string problem;            // why it stopped by itself; empty: it did not
};

/// Records what the streams tell. Thread safe; nothing blocks. Errors go to `done`:
///   ResourceExhausted  too little room on the disk
///   Unavailable        it cannot be written to; the server is shutting down
class RecordingPort {
 public:
  virtual ~RecordingPort() = default;
  virtual RecordingState recording() const = 0;
  /// Where one is on, that one goes on.
  virtual void StartRecording(Done<RecordingState> done) = 0;
  /// Answered once the file is whole.
  virtual void StopRecording(Done<RecordingState> done) = 0;
};

}  // namespace saccade
