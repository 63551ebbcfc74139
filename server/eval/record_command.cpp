#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <iostream>
#include <thread>

#include "server/capture/source.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/end_at_signal.hpp"
#include "server/eval/frame_range.hpp"
#include "server/eval/record_source.hpp"

namespace saccade {

bool IsLive(absl::string_view uri) {
  return absl::StartsWith(uri, "v4l2:") || absl::StartsWith(uri, "rtsp:");
}

absl::Status RefusePhone(absl::string_view uri) {
  if (!absl::StartsWith(uri, "phone:")) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "--source phone: a phone's browser sends its pictures to a saccade-server alone, and this "
      "program is none; film with the phone's own camera, copy the video here, and give "
      "--source file:VIDEO");
}

absl::Status RecordCommand(const RenderArguments& arguments) {
  if (absl::Status phone = RefusePhone(arguments.source); !phone.ok()) return phone;
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
