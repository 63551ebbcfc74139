#include "server/eval/source_pictures.hpp"

#include <absl/strings/str_cat.h>

#include <iostream>
#include <optional>
#include <thread>

#include "server/capture/source.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/end_at_signal.hpp"
#include "server/eval/frame_range.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostPictures = 120;

}  // namespace

absl::StatusOr<std::unique_ptr<FrameSource>> OpenToCalibrate(const std::string& uri,
                                                             const std::string& frames) {
  if (absl::Status phone = RefusePhone(uri); !phone.ok()) return phone;
  const absl::StatusOr<FrameRange> range = ParseFrameRange(frames);
  if (!range.ok()) return range.status();
  SourceOptions options;
  options.realtime = IsLive(uri);
  options.first_frame = range->first;
  options.end_frame = range->end;
  options.lens_may_be_missing = true;
  SourceRegistry sources = CaptureSources();
  sources.Add("sim",
              [](absl::string_view rest,
                 const SourceOptions& with) -> absl::StatusOr<std::unique_ptr<FrameSource>> {
                return SimSource::OpenUri(rest, with);
              });
  return sources.Open(uri, options);
}

absl::StatusOr<PictureSet> PicturesOfSource(const std::string& uri, const std::string& frames,
                                            double seconds, double& fps) {
  const EndAtSignal signals;
  const absl::StatusOr<std::unique_ptr<FrameSource>> source = OpenToCalibrate(uri, frames);
  if (!source.ok()) return source.status();
  fps = (*source)->info().camera->intrinsics().fps;
  if (IsLive(uri) && seconds <= 0) {
    std::cerr << "move the target through the whole picture, tilted each way; Ctrl-C ends\n";
  }
  EvenPictures kept(kMostPictures);
  {
    const std::jthread watch = signals.Watch(**source);
    std::optional<Timestamp> begin_ns;
    while (true) {
      const absl::StatusOr<std::optional<Frame>> frame = (*source)->Next();
      if (!frame.ok()) return frame.status();
      if (!frame->has_value()) break;
      const Timestamp at_ns = (*frame)->capture_time_ns;
      if (!begin_ns) begin_ns = at_ns;
      if (seconds > 0 && Seconds(at_ns - *begin_ns) > seconds) break;
      kept.Offer(absl::StrCat("frame ", (*frame)->id), (*frame)->grey);
    }
  }
  signals.Release();  // the fit takes minutes, and may be given up
  PictureSet pictures = std::move(kept).Take(uri);
  if (pictures.size() > 0) return pictures;
  return absl::DataLossError(absl::StrCat("source ", uri, ": gave no picture"));
}

}  // namespace saccade
