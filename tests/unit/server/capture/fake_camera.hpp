#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shared/io/video_device.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A camera as the kernel shows it through ioctl, mmap and poll; outlives the devices that are
/// opened on it. Pictures come when a test pushes them, as if the sensor had them then.
class FakeCamera {
 public:
  struct Control {
    int least, most, value;
  };
  struct Mode {
    std::uint32_t fourcc;
    int width, height;
    std::vector<int> fps;
  };

  std::vector<Mode> modes = {{V4L2_PIX_FMT_YUYV, 64, 48, {30, 15}}};
  std::map<std::uint32_t, Control> controls;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  int padding = 0;        // bytes behind each line
  int start_refused = 0;  // errno of VIDIOC_STREAMON
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;

  struct Shot {
    std::vector<std::uint8_t> bytes = {};
    std::uint32_t flags = 0;                 // beside those of the stamp
    std::optional<std::size_t> used = {};    // bytesused, if not all
    std::optional<Timestamp> stamp_ns = {};  // now, if not said
    std::uint32_t skipped = 0;               // of the sequence, before this one
  };
  /// Into the next free buffer; waits for one (the reader's thread gives it back), for 5 s.
  bool Push(const Shot& shot) {
    std::unique_lock lock(mutex_);
    sequence_ += shot.skipped;
    const auto ready = [this] { return streams_ && !free_.empty(); };
    if (!changed_.wait_for(lock, std::chrono::seconds(5), ready)) return false;
    v4l2_buffer filled{};
    filled.index = free_.front();
    free_.pop_front();
    std::vector<std::uint8_t>& memory = memory_[filled.index];
    std::memcpy(memory.data(), shot.bytes.data(), std::min(memory.size(), shot.bytes.size()));
    filled.bytesused = static_cast<__u32>(shot.used.value_or(shot.bytes.size()));
    filled.flags = stamp_flags | shot.flags;
    filled.sequence = sequence_++;
    const Timestamp stamp_ns = shot.stamp_ns.value_or(MonotonicNow());
    filled.timestamp.tv_sec = stamp_ns / 1'000'000'000;
    filled.timestamp.tv_usec = stamp_ns % 1'000'000'000 / 1000;
    done_.push_back(filled);
    changed_.notify_all();
    return true;
  }
  /// All that was pushed has been read and given back.
  bool WaitUntilDrained() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(5),
                             [this] { return free_.size() == memory_.size(); });
  }
  void SetPlugged(bool plugged) {
    const std::lock_guard lock(mutex_);
    plugged_ = plugged;
    if (!plugged) ++generation_;  // what is open now stays gone
    changed_.notify_all();
  }
  int Value(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    return controls.at(id).value;
  }
  int opened() const { return opened_; }
  int closed() const { return closed_; }
  int fps_set() const { return fps_set_; }

  static OpenCaptureDevice Opener(const std::shared_ptr<FakeCamera>& camera) {
    return [camera](const std::string& path) -> absl::StatusOr<std::unique_ptr<CaptureDevice>> {
      const std::lock_guard lock(camera->mutex_);
      if (!camera->plugged_) return absl::NotFoundError(path + ": no such device");
      ++camera->opened_;
      return std::make_unique<Device>(camera);
    };
  }

 private:
  class Device final : public CaptureDevice {
   public:
    explicit Device(std::shared_ptr<FakeCamera> camera)
        : camera_(std::move(camera)), generation_(camera_->generation_) {}
    ~Device() override {
      const std::lock_guard lock(camera_->mutex_);
      camera_->streams_ = false;
      ++camera_->closed_;
    }
    int Ioctl(unsigned long request, void* argument) override {
      const std::lock_guard lock(camera_->mutex_);
      if (generation_ != camera_->generation_) return ENODEV;
      return camera_->Ioctl(request, argument);
    }
    int Map(std::size_t length, std::uint32_t offset, std::span<const std::uint8_t>* out) override {
      const std::lock_guard lock(camera_->mutex_);
      *out = std::span<const std::uint8_t>(camera_->memory_[offset].data(), length);
      return 0;
    }
    int Wait(int most_ms) override {
      std::unique_lock lock(camera_->mutex_);
      const auto gone = [this] { return generation_ != camera_->generation_; };
      const auto ready = [&] { return gone() || !camera_->done_.empty(); };
      if (!camera_->changed_.wait_for(lock, std::chrono::milliseconds(most_ms), ready)) {
        return ETIMEDOUT;
      }
      return gone() ? ENODEV : 0;
    }

   private:
    const std::shared_ptr<FakeCamera> camera_;
    const int generation_;
  };

  template <std::size_t N>
  static void Fill(__u8 (&field)[N], const char* text) {
    std::strncpy(reinterpret_cast<char*>(field), text, N - 1);
  }
  std::vector<Mode> ModesOf(std::uint32_t fourcc) const {
    std::vector<Mode> of;
    for (const Mode& mode : modes) {
      if (mode.fourcc == fourcc) of.push_back(mode);
    }
    return of;
  }

  int Ioctl(unsigned long request, void* argument);
  int Describe(unsigned long request, void* argument);
  int Adjust(unsigned long request, void* argument);
  int SetFormat(v4l2_format& format);
  int MakeBuffers(v4l2_requestbuffers& request);

  mutable std::mutex mutex_;  // everything below, and controls
  std::condition_variable changed_;
  bool plugged_ = true, streams_ = false;
  int generation_ = 0;
  std::atomic<int> opened_ = 0, closed_ = 0, fps_set_ = 0;
  std::uint32_t size_ = 0, sequence_ = 0;
  std::vector<std::vector<std::uint8_t>> memory_;
  std::deque<std::uint32_t> free_;
  std::deque<v4l2_buffer> done_;
};

inline int FakeCamera::Describe(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCAP) {
    auto& can = *static_cast<v4l2_capability*>(argument);
    Fill(can.card, "Fake Camera");
    Fill(can.driver, "fakevideo");
    can.capabilities = V4L2_CAP_DEVICE_CAPS;
    can.device_caps = capabilities;
    return 0;
  }
  if (request == VIDIOC_ENUM_FMT) {
    auto& format = *static_cast<v4l2_fmtdesc*>(argument);
    std::vector<std::uint32_t> codes;
    for (const Mode& mode : modes) {
      if (codes.empty() || codes.back() != mode.fourcc) codes.push_back(mode.fourcc);
    }
    if (format.index >= codes.size()) return EINVAL;
    format.pixelformat = codes[format.index];
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
    const std::vector<Mode> of = ModesOf(size.pixel_format);
    if (size.index >= of.size()) return EINVAL;
    size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    size.discrete.width = static_cast<__u32>(of[size.index].width);
    size.discrete.height = static_cast<__u32>(of[size.index].height);
    return 0;
  }
  if (request != VIDIOC_ENUM_FRAMEINTERVALS) return ENOTTY;
  auto& rate = *static_cast<v4l2_frmivalenum*>(argument);
  for (const Mode& mode : ModesOf(rate.pixel_format)) {
    if (mode.width != static_cast<int>(rate.width)) continue;
    if (rate.index >= mode.fps.size()) return EINVAL;
    rate.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    rate.discrete = {1, static_cast<__u32>(mode.fps[rate.index])};
    return 0;
  }
  return EINVAL;
}

inline int FakeCamera::SetFormat(v4l2_format& format) {
  v4l2_pix_format& pixels = format.fmt.pix;
  for (const Mode& mode : ModesOf(pixels.pixelformat)) {
    if (mode.width != static_cast<int>(pixels.width)) continue;
    const bool compressed = mode.fourcc == V4L2_PIX_FMT_MJPEG;
    const int line = mode.width * (mode.fourcc == V4L2_PIX_FMT_YUYV ? 2 : 1) + padding;
    pixels.height = static_cast<__u32>(mode.height);
    pixels.bytesperline = compressed ? 0 : static_cast<__u32>(line);
    pixels.sizeimage = static_cast<__u32>(line * mode.height * 3);
    size_ = pixels.sizeimage;
    return 0;
  }
  return EINVAL;
}

inline int FakeCamera::MakeBuffers(v4l2_requestbuffers& request) {
  memory_.assign(request.count, std::vector<std::uint8_t>(size_));
  free_.clear();
  done_.clear();
  sequence_ = 0;
  return 0;
}

inline int FakeCamera::Adjust(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCTRL) {
    auto& query = *static_cast<v4l2_queryctrl*>(argument);
    const auto found = controls.find(query.id);
    if (found == controls.end()) return EINVAL;
    query.minimum = found->second.least;
    query.maximum = found->second.most;
    return 0;
  }
  auto& control = *static_cast<v4l2_control*>(argument);
  const auto found = controls.find(control.id);
  if (found == controls.end()) return EINVAL;
  if (request == VIDIOC_G_CTRL) {
    control.value = found->second.value;
  } else {
    found->second.value = control.value;
  }
  return 0;
}

inline int FakeCamera::Ioctl(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_S_FMT:
      return SetFormat(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM: {
      const v4l2_fract& asked = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      fps_set_ = static_cast<int>(asked.denominator / asked.numerator);
      return 0;
    }
    case VIDIOC_REQBUFS:
      return MakeBuffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.length = size_;
      buffer.m.offset = buffer.index;
      return 0;
    }
    case VIDIOC_QBUF:
      free_.push_back(static_cast<v4l2_buffer*>(argument)->index);
      changed_.notify_all();
      return 0;
    case VIDIOC_DQBUF:
      if (done_.empty()) return EAGAIN;
      *static_cast<v4l2_buffer*>(argument) = done_.front();
      done_.pop_front();
      return 0;
    case VIDIOC_STREAMON:
      if (start_refused != 0) return start_refused;
      streams_ = true;
      changed_.notify_all();
      return 0;
    case VIDIOC_STREAMOFF:
      streams_ = false;
      return 0;
    case VIDIOC_QUERYCTRL:
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return Adjust(request, argument);
    default:
      return Describe(request, argument);
  }
}

}  // namespace saccade
