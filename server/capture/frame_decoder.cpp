#include "server/capture/frame_decoder.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/capture/camera_files/plausibility.hpp"
#include "server/capture/image_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kReadAhead = 6;  // frames
constexpr std::size_t kReadAheadBytes = std::size_t{64} << 20;

}  // namespace

FrameDecoder::FrameDecoder(std::filesystem::path folder, std::vector<ImageEntry> entries,
                           std::shared_ptr<const CameraModel> camera, std::string camera_file)
    : folder_(std::move(folder)),
      entries_(std::move(entries)),
      camera_(std::move(camera)),
      camera_file_(std::move(camera_file)) {}

absl::StatusOr<Frame> FrameDecoder::Decode(std::size_t index) const {
  const ImageEntry& entry = entries_[index];
  const auto check = [this](cv::Size size) { return CheckSize(size); };
  absl::StatusOr<DecodedPicture> picture = LoadPicture(folder_ / entry.file, check);
  if (!picture.ok()) return picture.status();
  // What was decoded, where the header said something else.
  if (const absl::Status size = CheckSize(picture->grey.size()); !size.ok()) {
    return absl::DataLossError(absl::StrCat((folder_ / entry.file).string(), ": ", size.message()));
  }
  Frame frame;
  frame.id = index;
  frame.capture_time_ns = entry.time_ns;
  frame.received_time_ns = MonotonicNow();
  frame.source_timestamp = entry.timestamp;
  frame.grey = std::move(picture->grey);
  frame.color = std::move(picture->color);
  frame.camera = camera_;
  return frame;
}

std::size_t FrameDecoder::read_ahead() const {
  const auto pixels = static_cast<std::size_t>(camera_->width()) * camera_->height();
  return std::clamp(kReadAheadBytes / (4 * pixels), std::size_t{1}, kReadAhead);
}

absl::Status FrameDecoder::CheckSize(cv::Size size) const {
  if (size.width == camera_->width() && size.height == camera_->height()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "is ", size.width, "x", size.height, " but ", camera_file_, " says ", camera_->width(), "x",
      camera_->height(), "; correct width and height (and fx, fy, cx, cy with them): ",
      SizeRemedy(camera_->intrinsics(), size)));
}

}  // namespace saccade
