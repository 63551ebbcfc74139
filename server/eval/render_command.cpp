#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <iostream>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "server/capture/camera_yaml.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/frame_range.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/trajectory.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {
namespace {

struct SimFrames {
  std::unique_ptr<SimSource> source;
  std::uint64_t first = 0, end = 0;
};

absl::StatusOr<SimFrames> OpenFrames(const RenderArguments& arguments) {
  absl::string_view rest = arguments.source;
  if (!absl::ConsumePrefix(&rest, "sim:")) {
    return absl::InvalidArgumentError(
        absl::StrCat("--source ", arguments.source,
                     ": only simulated sources are rendered; give sim:desk[?...]"));
  }
  const absl::StatusOr<FrameRange> range = ParseFrameRange(arguments.frames);
  if (!range.ok()) return range.status();
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::OpenUri(rest, {});
  if (!source.ok()) return source.status();
  const std::optional<std::uint64_t> end = range->end ? range->end : (*source)->info().frame_count;
  if (!end) {
    return absl::InvalidArgumentError(
        "--frames has no end, and neither has the source; give A:B or duration=S");
  }
  return SimFrames{*std::move(source), range->first, *end};
}

absl::Status WritePicture(const std::filesystem::path& file, const cv::Mat& picture) {
  if (cv::imwrite(file.string(), picture)) return absl::OkStatus();
  return absl::NotFoundError(
      absl::StrCat("--out ", file.string(), ": cannot be written; is the folder writable?"));
}

absl::Status WriteDepth(const std::filesystem::path& file, const absl::StatusOr<cv::Mat>& depth_m) {
  if (!depth_m.ok()) return depth_m.status();
  constexpr double kPerMetre = 5000;
  const cv::Mat beyond = *depth_m > std::numeric_limits<std::uint16_t>::max() / kPerMetre;
  cv::Mat depth;
  depth_m->convertTo(depth, CV_16UC1, kPerMetre);
  depth.setTo(0, beyond);
  return WritePicture(file, depth);
}

}  // namespace

absl::Status RenderCommand(const RenderArguments& arguments) {
  absl::StatusOr<SimFrames> frames = OpenFrames(arguments);
  if (!frames.ok()) return frames.status();
  std::error_code failed;
  std::filesystem::create_directories(arguments.out, failed);
  for (std::uint64_t frame = frames->first; frame < frames->end; ++frame) {
    const absl::StatusOr<cv::Mat> picture = frames->source->RenderClean(frame);
    if (!picture.ok()) return picture.status();
    const std::filesystem::path file = arguments.out / absl::StrFormat("%06d.png", frame);
    if (absl::Status status = WritePicture(file, *picture); !status.ok()) return status;
    std::cout << file.string() << "\n";
    if (!arguments.depth) continue;
    const std::filesystem::path beside = arguments.out / absl::StrFormat("%06d.depth.png", frame);
    if (absl::Status status = WriteDepth(beside, frames->source->RenderDepth(frame));
        !status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

absl::Status RecordSimulator(const RenderArguments& arguments) {
  absl::StatusOr<SimFrames> frames = OpenFrames(arguments);
  if (!frames.ok()) return frames.status();
  const std::filesystem::path& out = arguments.out;
  if (absl::Status status = CreateFolder(out / "rgb"); !status.ok()) return status;
  absl::StatusOr<OutputFile> list = OutputFile::Create(out / "rgb.txt");
  if (!list.ok()) return list.status();
  absl::StatusOr<OutputFile> truth = OutputFile::Create(out / "groundtruth.txt");
  if (!truth.ok()) return truth.status();
  const std::string camera = CameraYaml(frames->source->info().camera->intrinsics());
  if (absl::Status status = WriteFileAtomically(out / "camera.yaml", camera); !status.ok()) {
    return status;
  }
  while (true) {
    absl::StatusOr<std::optional<Frame>> frame = frames->source->Next();
    if (!frame.ok()) return frame.status();
    if (!*frame || (*frame)->id >= frames->end) break;
    if ((*frame)->id < frames->first) continue;
    const std::string stamp = absl::StrFormat("%.6f", Seconds((*frame)->capture_time_ns));
    const std::string name = absl::StrCat("rgb/", stamp, ".png");
    const cv::Mat& picture = (*frame)->color.empty() ? (*frame)->grey : (*frame)->color;
    if (absl::Status status = WritePicture(out / name, picture); !status.ok()) return status;
    list->Write(absl::StrCat(stamp, " ", name, "\n"));
    truth->Write(TumLine(stamp, frames->source->WorldFromCamera((*frame)->id)));
  }
  if (absl::Status status = list->Close(); !status.ok()) return status;
  return truth->Close();
}

}  // namespace saccade
