#include "server/eval/record_source.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "server/capture/camera_yaml.hpp"
#include "server/eval/output_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr Timestamp kSecond_ns = 1'000'000'000;

/// The time as the source has it, else with every nanosecond.
std::string StampOf(const Frame& frame) {
  if (!frame.source_timestamp.empty()) return frame.source_timestamp;
  return absl::StrFormat("%d.%09d", frame.capture_time_ns / kSecond_ns,
                         frame.capture_time_ns % kSecond_ns);
}

absl::Status WritePng(const std::filesystem::path& file, const cv::Mat& picture) {
  // Level 1: a live camera waits for nobody.
  bool written = false;
  try {
    written = cv::imwrite(file.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 1});
  } catch (const std::exception&) {  // no memory: said below
  }
  if (written) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(file.string(), ": cannot be written; free some space or give another --out"));
}

}  // namespace

absl::StatusOr<Recorded> RecordSource(FrameSource& source, const std::filesystem::path& out,
                                      const RecordLimits& limits) {
  if (MayExist(out / "rgb.txt")) {
    return absl::AlreadyExistsError(
        absl::StrCat(out.string(), ": holds a recording already; give another folder as --out"));
  }
  if (absl::Status made = CreateFolder(out / "rgb"); !made.ok()) return made;
  const SourceInfo& info = source.info();
  const std::string camera = CameraYaml(info.camera->intrinsics(), info.remark);
  if (absl::Status put = WriteFileAtomically(out / "camera.yaml", camera); !put.ok()) return put;
  absl::StatusOr<OutputFile> list = OutputFile::Create(out / "rgb.txt");
  if (!list.ok()) return list.status();
  Recorded recorded;
  std::optional<Timestamp> begin_ns;
  while (!limits.frames || recorded.frames < *limits.frames) {
    const absl::StatusOr<std::optional<Frame>> next = source.Next();
    if (!next.ok()) return next.status();
    if (!next->has_value()) break;
    const Frame& frame = **next;
    if (!begin_ns) begin_ns = frame.capture_time_ns;
    if (limits.seconds && Seconds(frame.capture_time_ns - *begin_ns) > *limits.seconds) break;
    const std::string stamp = StampOf(frame);
    const std::string name = absl::StrCat("rgb/", stamp, ".png");
    const absl::Status put = WritePng(out / name, frame.color.empty() ? frame.grey : frame.color);
    if (!put.ok()) return put;
    list->Write(absl::StrCat(stamp, " ", name, "\n"));
    if (absl::Status flushed = list->Flush(); !flushed.ok()) return flushed;
    ++recorded.frames;
  }
  recorded.bad = source.bad_frames();
  recorded.dropped = source.dropped_frames();
  if (absl::Status closed = list->Close(); !closed.ok()) return closed;
  return recorded;
}

}  // namespace saccade
