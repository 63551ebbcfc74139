#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "server/eval/commands.hpp"
#include "server/eval/frame_range.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {

absl::Status RenderCommand(const RenderArguments& arguments) {
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
  std::error_code failed;
  std::filesystem::create_directories(arguments.out, failed);
  for (std::uint64_t frame = range->first; frame < *end; ++frame) {
    const absl::StatusOr<cv::Mat> picture = (*source)->RenderClean(frame);
    if (!picture.ok()) return picture.status();
    const std::filesystem::path file = arguments.out / absl::StrFormat("%06d.png", frame);
    if (!cv::imwrite(file.string(), *picture)) {
      return absl::NotFoundError(
          absl::StrCat("--out ", file.string(), ": cannot be written; is the folder writable?"));
    }
    std::cout << file.string() << "\n";
  }
  return absl::OkStatus();
}

}  // namespace saccade
