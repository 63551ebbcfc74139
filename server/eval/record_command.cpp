#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <signal.h>
#include <time.h>

#include <iostream>
#include <stop_token>
#include <thread>

#include "server/capture/source.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/frame_range.hpp"
#include "server/eval/record_source.hpp"

namespace saccade {
namespace {

/// Ends a recording in order at SIGINT or SIGTERM: whoever records from a camera has no other way.
class EndAtSignal {
 public:
  /// Before anything starts a thread.
  EndAtSignal() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// Must end before `source` does.
  std::jthread Watch(FrameSource& source) const {
    return std::jthread([signals = signals_, &source](const std::stop_token& stop) {
      constexpr timespec kLook{0, 100'000'000};
      while (!stop.stop_requested()) {
        if (sigtimedwait(&signals, nullptr, &kLook) > 0) source.Stop();
      }
    });
  }

 private:
  sigset_t signals_{};
};

bool IsLive(absl::string_view uri) {
  return absl::StartsWith(uri, "v4l2:") || absl::StartsWith(uri, "rtsp:");
}

}  // namespace

absl::Status RecordCommand(const RenderArguments& arguments) {
  if (absl::StartsWith(arguments.source, "sim:")) return RecordSimulator(arguments);
  const absl::StatusOr<FrameRange> range = ParseFrameRange(arguments.frames);
  if (!range.ok()) return range.status();
  const EndAtSignal signals;
  SourceOptions options;
  options.camera_file = arguments.camera;
  options.realtime = IsLive(arguments.source);
  options.first_frame = range->first;
  options.end_frame = range->end;
  const absl::StatusOr<std::unique_ptr<FrameSource>> source = OpenSource(arguments.source, options);
  if (!source.ok()) return source.status();
  const std::jthread watch = signals.Watch(**source);
  RecordLimits limits;
  if (arguments.seconds > 0) limits.seconds = arguments.seconds;
  const absl::StatusOr<Recorded> recorded = RecordSource(**source, arguments.out, limits);
  if (!recorded.ok()) return recorded.status();
  std::cout << arguments.out.string() << ": " << recorded->frames << " frames, " << recorded->bad
            << " bad, " << recorded->dropped
            << " dropped; open it with --source dataset:" << arguments.out.string() << "\n";
  if (recorded->frames > 0) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("source ", arguments.source, ": gave no frame; nothing was recorded"));
}

}  // namespace saccade
