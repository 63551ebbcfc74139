#include "server/capture/v4l2/v4l2_source.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "server/capture/assumed_lens.hpp"
#include "server/capture/camera_file.hpp"
#include "server/capture/v4l2/v4l2_camera.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr int kLookForStop_ms = 100;
constexpr std::chrono::milliseconds kLookForDevice(200);
constexpr Timestamp kStalled_ns = 2'000'000'000;
constexpr Timestamp kLate_ns = 100'000'000;
constexpr Timestamp kTellAgain_ns = 10'000'000'000;

class V4l2Source final : public CameraSource {
 public:
  V4l2Source(V4l2Request request, SourceInfo info, OpenCaptureDevice open,
             std::unique_ptr<V4l2Camera> camera)
      : request_(std::move(request)),
        info_(std::move(info)),
        layout_(camera->layout()),
        fps_(info_.camera->intrinsics().fps),
        open_(std::move(open)),
        camera_(std::move(camera)) {}
  ~V4l2Source() override { Stop(); }

  const SourceInfo& info() const override { return info_; }
  std::uint64_t bad_frames() const override { return counts().torn; }
  std::uint64_t dropped_frames() const override {
    const CameraCounts counts = this->counts();
    return counts.dropped + counts.superseded;
  }
  CameraCounts counts() const override {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

  absl::StatusOr<std::optional<Frame>> Next() override {
    while (std::optional<Numbered> next = TakeNewest()) {
      absl::StatusOr<DecodedPicture> picture = PictureFrom(layout_, next->raw.bytes);
      if (!picture.ok()) {
        const std::lock_guard lock(mutex_);
        ++counts_.torn;
        continue;
      }
      Frame frame;
      frame.id = next->id;
      frame.capture_time_ns = next->raw.capture_ns;
      frame.received_time_ns = MonotonicNow();
      DecodedPicture upright = Turned(*std::move(picture), request_.turn);
      frame.grey = std::move(upright.grey);
      frame.color = std::move(upright.color);
      frame.camera = info_.camera;
      CountLate(frame);
      return frame;
    }
    return std::nullopt;
  }

  void Stop() override {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    reader_.request_stop();
    changed_.notify_all();
  }

 private:
  struct Numbered {
    FrameId id = 0;
    RawPicture raw;
  };

  /// Waits; nothing once stopped.
  std::optional<Numbered> TakeNewest() {
    std::unique_lock lock(mutex_);
    if (!reader_.joinable() && !stopped_) {
      reader_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
    }
    changed_.wait(lock, [this] { return stopped_ || newest_; });
    if (stopped_) return std::nullopt;
    return std::exchange(newest_, std::nullopt);
  }

  void CountLate(const Frame& frame) {
    const Timestamp limit_ns = std::max(kLate_ns, static_cast<Timestamp>(3e9 / fps_));
    const std::lock_guard lock(mutex_);
    if (frame.received_time_ns - frame.capture_time_ns > limit_ns) ++counts_.late;
  }

  // The capture thread: everything below.
  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (camera_ == nullptr && !Reopen(stop)) return;
      const absl::Status gone = Drain(stop);
      if (stop.stop_requested()) return;
      camera_.reset();  // first of all: an open file keeps the device's number from it
      gone_ns_ = MonotonicNow();
      Log(absl::StrCat("camera ", gone.message(), "; waiting for it"));
      const std::lock_guard lock(mutex_);
      ++counts_.unplugged;
    }
  }

  /// Takes pictures until the device is gone or gives no more; says which.
  absl::Status Drain(const std::stop_token& stop) {
    const Timestamp stalled_ns = std::max(kStalled_ns, static_cast<Timestamp>(5e9 / fps_));
    Timestamp last_ns = MonotonicNow();
    while (!stop.stop_requested()) {
      absl::StatusOr<RawPicture> raw = camera_->Next(kLookForStop_ms);
      if (raw.ok()) {
        last_ns = MonotonicNow();
        Offer(*std::move(raw));
        TellCounts(last_ns);
      } else if (!absl::IsDeadlineExceeded(raw.status())) {
        return raw.status();
      } else if (MonotonicNow() - last_ns > stalled_ns) {
        return absl::UnavailableError(absl::StrFormat("%s: has given no picture for %.1f s",
                                                      request_.device, Seconds(stalled_ns)));
      }
    }
    return absl::OkStatus();
  }

  void Offer(RawPicture raw) {
    const std::lock_guard lock(mutex_);
    counts_.dropped += raw.lost;
    next_id_ += raw.lost;
    const FrameId id = next_id_++;
    const bool backwards = raw.capture_ns <= last_capture_ns_;
    if (raw.torn || backwards) {
      ++counts_.torn;
      return;
    }
    last_capture_ns_ = raw.capture_ns;
    if (newest_) ++counts_.superseded;
    newest_ = Numbered{id, std::move(raw)};
    changed_.notify_all();
  }

  /// Looks for the camera until it is there, as it was; false if stopped.
  bool Reopen(const std::stop_token& stop) {
    std::string told;
    while (!stop.stop_requested()) {
      absl::StatusOr<std::unique_ptr<CaptureDevice>> device = open_(request_.device);
      if (device.ok()) {
        const absl::Status back = TakeBack(*std::move(device));
        if (back.ok()) return true;
        if (told != back.message()) Log(absl::StrCat("camera ", back.message(), "; waiting"));
        told = std::string(back.message());
      }
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, stop, kLookForDevice, [this] { return stopped_; });
    }
    return false;
  }

  absl::Status TakeBack(std::unique_ptr<CaptureDevice> device) {
    V4l2Request as_before = request_;
    as_before.width = layout_.width;
    as_before.height = layout_.height;
    as_before.format = FindVideoFormat(FormatName(layout_.fourcc));
    absl::StatusOr<std::unique_ptr<V4l2Camera>> camera = V4l2Camera::Open(
        as_before, info_.camera->intrinsics().rolling_shutter_readout_s, std::move(device));
    if (!camera.ok()) return camera.status();
    if ((*camera)->layout().stride != layout_.stride) {
      return absl::FailedPreconditionError(
          absl::StrCat(request_.device, ": is another camera than before; start anew with it"));
    }
    camera_ = *std::move(camera);
    Log(absl::StrFormat("camera %s: back after %.1f s", request_.device,
                        Seconds(MonotonicNow() - gone_ns_)));
    return absl::OkStatus();
  }

  void TellCounts(Timestamp now_ns) {
    const CameraCounts now = counts();
    const std::uint64_t sum = now.dropped + now.torn + now.late;
    if (sum == told_sum_ || now_ns - told_ns_ < kTellAgain_ns) return;
    told_sum_ = sum;
    told_ns_ = now_ns;
    Log(absl::StrCat("camera ", request_.device, ": so far ", now.dropped,
                     " frames left out by the driver, ", now.torn, " torn, ", now.late, " late"));
  }

  const V4l2Request request_;
  const SourceInfo info_;
  const V4l2Layout layout_;
  const double fps_;
  const OpenCaptureDevice open_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool stopped_ = false;            // guarded by mutex_, as what follows
  std::optional<Numbered> newest_;  // not yet taken
  CameraCounts counts_;

  // Capture thread.
  std::unique_ptr<V4l2Camera> camera_;  // null: gone
  FrameId next_id_ = 0;
  Timestamp last_capture_ns_ = 0, gone_ns_ = 0, told_ns_ = 0;
  std::uint64_t told_sum_ = 0;
  std::jthread reader_;  // last: joins before the rest goes
};

absl::Status CheckLive(absl::string_view rest, const SourceOptions& options) {
  if (options.first_frame > 0 || options.end_frame) {
    return absl::InvalidArgumentError(
        absl::StrCat("source v4l2:", rest, ": a camera has no range of frames; leave it out"));
  }
  if (!options.realtime) {
    return absl::InvalidArgumentError(
        absl::StrCat("source v4l2:", rest, ": a camera waits for nobody: leave --speed max out"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<CameraSource>> OpenV4l2(absl::string_view rest,
                                                       const SourceOptions& options,
                                                       OpenCaptureDevice open) {
  if (absl::Status live = CheckLive(rest, options); !live.ok()) return live;
  absl::StatusOr<V4l2Request> request = V4l2Request::Parse(rest);
  if (!request.ok()) return request.status();
  const bool swaps = request->turn.swaps_sides();
  std::optional<CameraIntrinsics> lens;
  if (!options.camera_file.empty()) {
    const absl::StatusOr<CameraIntrinsics> read =
        LoadCamera(options.camera_file, [&]() -> std::optional<cv::Size> {
          if (!request->width || !request->height) return std::nullopt;
          const cv::Size asked(*request->width, *request->height);
          return swaps ? cv::Size(asked.height, asked.width) : asked;
        });
    if (!read.ok()) return read.status();
    lens = *read;
    if (!request->width) {
      request->width = swaps ? lens->height : lens->width;
      request->height = swaps ? lens->width : lens->height;
    }
  }
  absl::StatusOr<std::unique_ptr<CaptureDevice>> device = open(request->device);
  if (!device.ok()) return device.status();
  absl::StatusOr<std::unique_ptr<V4l2Camera>> camera =
      V4l2Camera::Open(*request, lens ? lens->rolling_shutter_readout_s : 0.0, *std::move(device));
  if (!camera.ok()) return camera.status();
  cv::Size size((*camera)->layout().width, (*camera)->layout().height);
  if (swaps) std::swap(size.width, size.height);
  SourceInfo info;
  info.uri = absl::StrCat("v4l2:", rest);
  if (!lens) {
    lens = AssumedLens(size, swaps, (*camera)->fps());
    info.remark = AssumedLensWords();
    info.lens_assumed = true;
    Log(absl::StrCat("camera ", request->device, ": ", AssumedLensWords()));
  } else if (lens->width != size.width || lens->height != size.height) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.camera_file.string(), ": is of pictures of ", lens->width, "x",
                     lens->height, ", and ", request->device, " was asked for ", size.width, "x",
                     size.height, " (upright); leave size out, or give the file of that size"));
  }
  if ((*camera)->fps() > 0) lens->fps = (*camera)->fps();
  info.camera = std::make_shared<const CameraModel>(*lens);
  Log(absl::StrFormat("camera %s: %s, %s %dx%d at %.4g fps", request->device, (*camera)->name(),
                      FormatName((*camera)->layout().fourcc), (*camera)->layout().width,
                      (*camera)->layout().height, lens->fps));
  return std::make_unique<V4l2Source>(*std::move(request), std::move(info), std::move(open),
                                      *std::move(camera));
}

}  // namespace saccade
