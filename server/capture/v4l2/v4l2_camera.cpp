#include "server/capture/v4l2/v4l2_camera.hpp"

#include <absl/strings/str_cat.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "server/capture/v4l2/camera_controls.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr __u32 kBuffers = 4;
constexpr Timestamp kAskExposure_ns = 1'000'000'000;  // how often an automatic one is asked for
// Of a camera that does not say: the usual room light.
constexpr Timestamp kUnknownExposure_ns = 10'000'000;
constexpr Timestamp kFuture_ns = 50'000'000, kPast_ns = 2'000'000'000;  // stamps are not believed

v4l2_buffer EmptyBuffer() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

Timestamp StampOf(const v4l2_buffer& buffer) {
  return Timestamp{buffer.timestamp.tv_sec} * 1'000'000'000 +
         Timestamp{buffer.timestamp.tv_usec} * 1'000;
}

}  // namespace

Timestamp MidExposure(Timestamp stamp_ns, std::uint32_t flags, Timestamp exposure_ns,
                      Timestamp readout_ns) {
  const Timestamp half = (exposure_ns + readout_ns) / 2;
  const bool start = (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  return start ? stamp_ns + half : stamp_ns - half;
}

V4l2Camera::V4l2Camera(const V4l2Request& request, double readout_s,
                       std::unique_ptr<CaptureDevice> device)
    : request_(request),
      readout_ns_(static_cast<Timestamp>(readout_s * 1e9)),
      device_(std::move(device)) {}

V4l2Camera::~V4l2Camera() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (streams_) (void)device_->Ioctl(VIDIOC_STREAMOFF, &type);
}

absl::StatusOr<std::unique_ptr<V4l2Camera>> V4l2Camera::Open(
    const V4l2Request& request, double readout_s, std::unique_ptr<CaptureDevice> device) {
  const absl::StatusOr<VideoDeviceFacts> facts = ReadVideoDevice(request.device, *device);
  if (!facts.ok()) return facts.status();
  const absl::StatusOr<VideoMode> mode = ChooseMode(*facts, request);
  if (!mode.ok()) return mode.status();
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(request, readout_s, std::move(device)));
  camera->name_ = facts->name;
  if (absl::Status set = camera->SetMode(*mode); !set.ok()) {
    return absl::Status(set.code(),
                        absl::StrCat(set.message(), "; it has ", ModeWords(facts->modes)));
  }
  camera->SetRate();
  if (absl::Status set = SetControls(*camera->device_, request); !set.ok()) return set;
  if (absl::Status started = camera->StartStream(); !started.ok()) return started;
  return camera;
}

absl::Status V4l2Camera::Problem(int error, const char* what) const {
  if (error == ENODEV || error == ENXIO || error == EIO || error == EBADF) {
    return absl::UnavailableError(
        absl::StrCat(request_.device, ": gone; plug the camera in again"));
  }
  const char* remedy = error == EBUSY    ? "another program uses it: close that"
                       : error == ENOSPC ? "no USB bandwidth is left: ask for format=mjpeg, a "
                                           "smaller size or another port"
                                         : std::strerror(error);
  return absl::FailedPreconditionError(absl::StrCat(request_.device, ": ", what, ": ", remedy));
}

absl::Status V4l2Camera::SetMode(const VideoMode& mode) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (mode.width == 0) (void)device_->Ioctl(VIDIOC_G_FMT, &format);
  v4l2_pix_format& pixels = format.fmt.pix;
  if (mode.width > 0) {
    pixels.width = static_cast<__u32>(mode.width);
    pixels.height = static_cast<__u32>(mode.height);
  }
  pixels.pixelformat = mode.fourcc;
  pixels.field = V4L2_FIELD_NONE;
  pixels.bytesperline = 0;
  if (const int error = device_->Ioctl(VIDIOC_S_FMT, &format); error != 0) {
    return Problem(error, "does not take this format");
  }
  const int width = static_cast<int>(pixels.width), height = static_cast<int>(pixels.height);
  if (pixels.pixelformat != mode.fourcc ||
      (mode.width > 0 && (width != mode.width || height != mode.height))) {
    return absl::FailedPreconditionError(
        absl::StrCat(request_.device, ": asked for ", ModeWords(mode), ", gives ",
                     FormatName(pixels.pixelformat), " ", width, "x", height));
  }
  const int least = mode.fourcc == V4L2_PIX_FMT_YUYV ? 2 * width : width;
  layout_ = {mode.fourcc, width, height, std::max(least, static_cast<int>(pixels.bytesperline))};
  if (width > kMaxPictureSide_px || height > kMaxPictureSide_px || width < 16 || height < 16) {
    return absl::FailedPreconditionError(absl::StrCat(request_.device, ": ", width, "x", height,
                                                      " is no size that is read; ask for another"));
  }
  return absl::OkStatus();
}

void V4l2Camera::SetRate() {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  interval.numerator = 1000;
  interval.denominator = static_cast<__u32>(std::lround(1000 * request_.fps.value_or(30)));
  if (device_->Ioctl(VIDIOC_S_PARM, &parameters) != 0 &&
      device_->Ioctl(VIDIOC_G_PARM, &parameters) != 0) {
    return;
  }
  if (interval.numerator > 0) fps_ = 1.0 * interval.denominator / interval.numerator;
}

absl::Status V4l2Camera::StartStream() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device_->Ioctl(VIDIOC_REQBUFS, &request); error != 0) {
    return Problem(error, "gives no buffers");
  }
  for (__u32 index = 0; index < request.count; ++index) {
    v4l2_buffer buffer = EmptyBuffer();
    buffer.index = index;
    int error = device_->Ioctl(VIDIOC_QUERYBUF, &buffer);
    std::span<const std::uint8_t> memory;
    if (error == 0) error = device_->Map(buffer.length, buffer.m.offset, &memory);
    if (error == 0) error = device_->Ioctl(VIDIOC_QBUF, &buffer);
    if (error != 0) return Problem(error, "a buffer cannot be mapped");
    buffers_.push_back(memory);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = device_->Ioctl(VIDIOC_STREAMON, &type); error != 0) {
    return Problem(error, "does not start");
  }
  streams_ = true;
  return absl::OkStatus();
}

Timestamp V4l2Camera::Exposure(Timestamp now_ns) {
  const bool fixed = request_.exposure_ms.has_value();
  if (exposure_read_ns_ == 0 || (!fixed && now_ns - exposure_read_ns_ > kAskExposure_ns)) {
    exposure_read_ns_ = now_ns;
    exposure_ns_ = ReadExposure(*device_);
  }
  const auto longest = static_cast<Timestamp>(1e9 / (fps_ > 0 ? fps_ : 30.0));
  return std::min(exposure_ns_.value_or(kUnknownExposure_ns), longest);
}

absl::StatusOr<RawPicture> V4l2Camera::Next(int most_ms) {
  const int waited = device_->Wait(most_ms);
  if (waited == ETIMEDOUT) return absl::DeadlineExceededError("");
  if (waited != 0) return Problem(waited, "cannot be waited for");
  v4l2_buffer buffer = EmptyBuffer();
  const int error = device_->Ioctl(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return absl::DeadlineExceededError("");
  if (error != 0) return Problem(error, "gives no picture");
  RawPicture picture;
  picture.received_ns = MonotonicNow();
  if (buffer.index >= buffers_.size()) return Problem(EIO, "");
  const std::size_t used = std::min<std::size_t>(buffer.bytesused, buffers_[buffer.index].size());
  const std::size_t whole = WholeBytes(layout_);
  picture.torn = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || used == 0 || used < whole;
  if (!picture.torn) {
    const auto bytes = buffers_[buffer.index].first(whole > 0 ? whole : used);
    picture.bytes.assign(bytes.begin(), bytes.end());
  }
  if (sequence_ && buffer.sequence > *sequence_) picture.lost = buffer.sequence - *sequence_ - 1;
  sequence_ = buffer.sequence;
  const Timestamp stamp_ns = StampOf(buffer);
  const bool monotonic =
      (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const Timestamp age_ns = picture.received_ns - stamp_ns;
  const bool believed = monotonic && age_ns > -kFuture_ns && age_ns < kPast_ns;
  if (!believed && !std::exchange(stamp_told_, true)) {
    Log(absl::StrCat(request_.device,
                     ": the driver's time stamps are not of this clock; frames are stamped by "
                     "their arrival"));
  }
  picture.capture_ns =
      MidExposure(believed ? stamp_ns : picture.received_ns, believed ? buffer.flags : 0,
                  Exposure(picture.received_ns), readout_ns_);
  if (const int back = device_->Ioctl(VIDIOC_QBUF, &buffer); back != 0) {
    return Problem(back, "does not take its buffer back");
  }
  return picture;
}

}  // namespace saccade
