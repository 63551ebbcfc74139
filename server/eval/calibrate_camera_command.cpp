#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <unistd.h>

#include <iostream>
#include <thread>

#include "server/capture/camera_file.hpp"
#include "server/capture/camera_yaml.hpp"
#include "server/eval/calibrate/lens_report.hpp"
#include "server/eval/calibrate/source_pictures.hpp"
#include "server/eval/calibrate/view_picker.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/end_at_signal.hpp"
#include "server/eval/output_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr Timestamp kSilence_ns = 2'000'000'000;

/// What happens, to stderr: each view that is taken, and what is missing when none is for a while.
class Progress {
 public:
  Progress(const ViewPicker& picker, bool json) : picker_(picker), json_(json) {}

  void Say(const Frame& frame, std::optional<ViewPicker::Verdict> verdict) {
    const bool taken = verdict == ViewPicker::Verdict::kTaken;
    if (!said_ns_) said_ns_ = frame.capture_time_ns;
    if (!taken && frame.capture_time_ns - *said_ns_ < kSilence_ns) return;
    said_ns_ = frame.capture_time_ns;
    std::string next = picker_.Advice();
    if (!verdict) next = "no whole board in view: show all of it, without glare; " + next;
    if (verdict == ViewPicker::Verdict::kMoving) next = "hold it still; " + next;
    if (json_) {
      const nlohmann::ordered_json line = {{"views", picker_.views().size()},
                                           {"frame", frame.id},
                                           {"covered", picker_.Covered()},
                                           {"next", next}};
      std::cerr << line.dump() << "\n";
      return;
    }
    std::cerr << absl::StrFormat("%2d views, %3.0f %% of the picture (frame %d); %s\n",
                                 picker_.views().size(), 100 * picker_.Covered(), frame.id,
                                 next.empty() ? "enough" : next);
  }

 private:
  const ViewPicker& picker_;
  bool json_;
  std::optional<Timestamp> said_ns_;
};

absl::Status Collect(FrameSource& source, const BoardPattern& pattern,
                     const CalibrateArguments& arguments, ViewPicker& picker) {
  Progress progress(picker, arguments.json);
  std::optional<Timestamp> begin_ns;
  const bool live = IsLive(arguments.source);
  while (!live || !picker.Complete()) {
    const absl::StatusOr<std::optional<Frame>> frame = source.Next();
    if (!frame.ok()) return frame.status();
    if (!frame->has_value()) break;
    const Timestamp at_ns = (*frame)->capture_time_ns;
    if (!begin_ns) begin_ns = at_ns;
    if (arguments.seconds > 0 && Seconds(at_ns - *begin_ns) > arguments.seconds) break;
    BoardView view{(*frame)->id, at_ns, FindBoard((*frame)->grey, pattern), pattern.Points()};
    std::optional<ViewPicker::Verdict> verdict;
    if (!view.corners.empty()) verdict = picker.Offer(view);
    progress.Say(**frame, verdict);
  }
  return absl::OkStatus();
}

/// Before the board is shown for minutes: whether its camera file could be written then.
absl::Status CheckOut(const std::filesystem::path& out) {
  if (MayExist(out)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", out.string(), " exists; name a new file"));
  }
  const std::filesystem::path folder =
      out.has_parent_path() ? out.parent_path() : std::filesystem::path(".");
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return absl::NotFoundError(absl::StrCat("--out ", out.string(), ": there is no folder ",
                                            folder.string(), "; make it"));
  }
  if (access(folder.c_str(), W_OK | X_OK) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat("--out ", out.string(),
                                                  ": nothing can be written into ", folder.string(),
                                                  "; name another folder"));
}

/// Written only if the server would read it.
absl::Status WriteCamera(const LensReport& report, double fps, const std::filesystem::path& out) {
  CameraIntrinsics lens = report.fit.lens;
  lens.fps = fps;
  const std::filesystem::path draft = out.string() + ".draft";
  const std::string text = CameraYaml(lens, CameraFileHeader(report));
  if (absl::Status put = WriteFileAtomically(draft, text); !put.ok()) return put;
  const absl::StatusOr<CameraIntrinsics> read = LoadCamera(draft);
  std::error_code error;
  if (!read.ok()) {
    std::filesystem::remove(draft, error);
    return absl::FailedPreconditionError(absl::StrCat(
        "too little to believe: the lens found is none that can be (", read.status().message(),
        "); show the board at all edges, and give --lens kannala_brandt for a fisheye"));
  }
  if (MayExist(out)) {
    return absl::AlreadyExistsError(absl::StrCat("--out: ", out.string(),
                                                 " was made meanwhile and is left as it is; the "
                                                 "camera is in ",
                                                 draft.string()));
  }
  std::filesystem::rename(draft, out, error);
  if (!error) return absl::OkStatus();
  return absl::NotFoundError(
      absl::StrCat("--out ", out.string(), ": cannot be written; is the folder writable?"));
}

}  // namespace

absl::Status CalibrateCameraCommand(const CalibrateArguments& arguments) {
  if (absl::Status possible = CheckOut(arguments.out); !possible.ok()) return possible;
  const absl::StatusOr<BoardPattern> pattern = ParseBoard(arguments.board, arguments.square_m);
  if (!pattern.ok()) return pattern.status();
  const LensModel model =
      arguments.lens == "kannala_brandt" ? LensModel::kKannalaBrandt : LensModel::kBrownConrady;
  const EndAtSignal signals;
  const absl::StatusOr<std::unique_ptr<FrameSource>> source =
      OpenToCalibrate(arguments.source, arguments.frames);
  if (!source.ok()) return source.status();
  const CameraIntrinsics& camera = (*source)->info().camera->intrinsics();
  const cv::Size picture(camera.width, camera.height);
  ViewPicker picker(picture);
  {
    const std::jthread watch = signals.Watch(**source);
    if (absl::Status seen = Collect(**source, *pattern, arguments, picker); !seen.ok()) return seen;
  }
  signals.Release();  // the fit takes minutes, and may be given up
  const absl::StatusOr<LensReport> report =
      Calibrate(arguments.source, picker, pattern->Words(), picture, model);
  if (!report.ok()) return report.status();
  std::cout << (arguments.json ? ReportJson(*report).dump(2) + "\n" : ReportText(*report));
  if (absl::Status enough = Judge(*report); !enough.ok()) return enough;
  if (absl::Status put = WriteCamera(*report, camera.fps, arguments.out); !put.ok()) return put;
  if (!arguments.json) {
    std::cout << arguments.out.string() << ": written; start the server with --camera "
              << arguments.out.string() << "\n";
  }
  return absl::OkStatus();
}

}  // namespace saccade
