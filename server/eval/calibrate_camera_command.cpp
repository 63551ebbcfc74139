#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <thread>

#include "server/calibrate/camera_output.hpp"
#include "server/calibrate/live_calibration.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/end_at_signal.hpp"
#include "server/eval/source_pictures.hpp"

namespace saccade {
namespace {

constexpr Timestamp kSilence_ns = 2'000'000'000;

/// What happens, to stderr: each view that is taken, and what is missing when none is for a while.
class Progress {
 public:
  Progress(const ViewPicker& picker, bool json) : picker_(picker), json_(json) {}

  void Say(const Frame& frame, const LiveCalibration::Look& look) {
    const bool taken = look.verdict == ViewPicker::Verdict::kTaken;
    if (!said_ns_) said_ns_ = frame.capture_time_ns;
    if (!taken && frame.capture_time_ns - *said_ns_ < kSilence_ns) return;
    said_ns_ = frame.capture_time_ns;
    if (json_) {
      const nlohmann::ordered_json line = {{"views", picker_.views().size()},
                                           {"frame", frame.id},
                                           {"covered", picker_.Covered()},
                                           {"next", look.next}};
      std::cerr << line.dump() << "\n";
      return;
    }
    std::cerr << absl::StrFormat("%2d views, %3.0f %% of the picture (frame %d); %s\n",
                                 picker_.views().size(), 100 * picker_.Covered(), frame.id,
                                 look.next.empty() ? "enough" : look.next);
  }

 private:
  const ViewPicker& picker_;
  bool json_;
  std::optional<Timestamp> said_ns_;
};

absl::Status Collect(FrameSource& source, const CalibrateArguments& arguments,
                     LiveCalibration& calibration) {
  Progress progress(calibration.picker(), arguments.json);
  std::optional<Timestamp> begin_ns;
  const bool live = IsLive(arguments.source);
  while (!live || !calibration.picker().Complete()) {
    const absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!frame->has_value()) break;
    const Timestamp at_ns = (*frame)->capture_time_ns;
    if (!begin_ns) begin_ns = at_ns;
    if (arguments.seconds > 0 && Seconds(at_ns - *begin_ns) > arguments.seconds) break;
    progress.Say(**frame, calibration.Offer((*frame)->id, at_ns, (*frame)->grey));
  }
  return absl::OkStatus();
}

/// What --target names, or --board with --square.
absl::StatusOr<std::unique_ptr<LensTarget>> TargetOf(const CalibrateArguments& arguments) {
  if (arguments.target.empty() == arguments.board.empty()) {
    return absl::InvalidArgumentError(
        "give --target (chessboard:9x6:0.025, charuco:7x5:0.04:0.03, aprilgrid:6x6:0.088:0.3, "
        "arucogrid:5x7:0.04:0.01), or --board 9x6 with --square 0.025");
  }
  if (!arguments.target.empty()) {
    absl::StatusOr<std::unique_ptr<LensTarget>> target = MakeLensTarget(arguments.target);
    if (target.ok()) return target;
    return absl::InvalidArgumentError(absl::StrCat("--", target.status().message()));
  }
  const absl::StatusOr<BoardPattern> pattern = ParseBoard(arguments.board, arguments.square_m);
  if (!pattern.ok()) return pattern.status();
  return MakeLensTarget(absl::StrFormat("chessboard:%dx%d:%.17g", pattern->columns, pattern->rows,
                                        pattern->square_m));
}

}  // namespace

absl::Status CalibrateCameraCommand(const CalibrateArguments& arguments) {
  if (absl::Status possible = CheckCameraOut(arguments.out); !possible.ok()) return possible;
  const absl::StatusOr<CameraTextForm> form = ParseCameraTextForm(arguments.form);
  if (!form.ok()) return form.status();
  absl::StatusOr<std::unique_ptr<LensTarget>> target = TargetOf(arguments);
  if (!target.ok()) return target.status();
  const EndAtSignal signals;
  const absl::StatusOr<std::unique_ptr<FrameSource>> source =
      OpenToCalibrate(arguments.source, arguments.frames);
  if (!source.ok()) return source.status();
  const CameraIntrinsics& camera = (*source)->info().camera->intrinsics();
  LiveCalibration calibration(*std::move(target), cv::Size(camera.width, camera.height));
  {
    const std::jthread watch = signals.Watch(**source);
    if (absl::Status seen = Collect(**source, arguments, calibration); !seen.ok()) return seen;
  }
  signals.Release();  // the fit takes minutes, and may be given up
  absl::StatusOr<LensReport> report =
      calibration.Fit(arguments.source, {arguments.lens, *form, /*hold_out=*/true});
  if (!report.ok()) return report.status();
  std::cout << (arguments.json ? ReportJson(*report).dump(2) + "\n" : ReportText(*report));
  if (absl::Status enough = Judge(*report); !enough.ok()) return enough;
  report->fit.lens.fps = camera.fps;
  absl::Status put =
      WriteCameraFile(arguments.out, *form, report->fit.lens, CameraFileHeader(*report));
  if (put.ok() && !arguments.json) {
    std::cout << arguments.out.string() << ": written; start the server with --camera "
              << arguments.out.string() << "\n";
  }
  return put;
}

}  // namespace saccade
