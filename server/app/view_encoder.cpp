#include "server/app/view_encoder.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <exception>

#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr Timestamp kKeyFrameInterval = 250'000'000;
constexpr Timestamp kIdle = 250'000'000;  // no frame for so long: the source stands still
constexpr Timestamp kRateInterval = 1'000'000'000;

}  // namespace

VideoEncoderOptions VideoOptions(int width, int height, double fps_hz, int bit_rate_bit_s) {
  VideoEncoderOptions options;
  options.width = width;
  options.height = height;
  options.fps_hz = std::clamp(fps_hz, 1.0, 240.0);
  options.bit_rate_bit_s = bit_rate_bit_s;
  return options;
}

ViewEncoder::ViewEncoder(VideoView view, int bit_rate_bit_s, DrawView draw, MayShow may_show,
                         EventSink& sink)
    : view_(view),
      bit_rate_bit_s_(bit_rate_bit_s),
      draw_(std::move(draw)),
      may_show_(std::move(may_show)),
      sink_(sink),
      runner_({.capacity = 1, .when_full = WhenFull::kDropOldest},
              [this](const TrackedFrame& frame) { Step(frame); }) {}

void ViewEncoder::Post(TrackedFrame frame) {
  {
    const std::lock_guard lock(mutex_);
    last_ = frame;
    posted_ns_ = MonotonicNow();
    redraw_due_ = false;
  }
  if (wanted_) runner_.Post(std::move(frame)).IgnoreError();  // stopped: nobody watches
}

void ViewEncoder::SetDemand(bool wanted) {
  if (wanted && !wanted_.exchange(true)) RequestKeyFrame();
  wanted_ = wanted;
}

void ViewEncoder::Redraw(TrackedFrame frame) {
  {
    const std::lock_guard lock(mutex_);
    last_ = std::move(frame);
  }
  RedrawNewest();
}

void ViewEncoder::RedrawNewest() {
  if (view_ != VideoView::kAugmented) return;  // nothing is drawn into the other
  redraw_due_ = true;
  Tick();
}

void ViewEncoder::Tick() {
  if (wanted_ && (redraw_due_ || key_requested_)) PostAgain();
}

void ViewEncoder::RequestKeyFrame() {
  key_requested_ = true;
  PostAgain();
}

void ViewEncoder::AwaitFrame() {
  const std::lock_guard lock(mutex_);
  posted_ns_ = MonotonicNow();
}

void ViewEncoder::PostAgain() {
  std::optional<TrackedFrame> again;
  {
    const std::lock_guard lock(mutex_);
    const Timestamp now_ns = MonotonicNow();
    if (!last_ || now_ns - posted_ns_ <= kIdle || now_ns - again_ns_ < kKeyFrameInterval) return;
    again_ns_ = now_ns;
    redraw_due_ = false;
    again = last_;
  }
  runner_.Post(*std::move(again)).IgnoreError();
}

bool ViewEncoder::TakeKeyFrameRequest(Timestamp now_ns) {
  if (!key_requested_ || now_ns - key_ns_ < kKeyFrameInterval) return false;
  key_requested_ = false;
  key_ns_ = now_ns;
  return true;
}

absl::Status ViewEncoder::Prepare(const cv::Mat& picture, const TrackedFrame& frame) {
  if (encoder_ != nullptr) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<VideoEncoder>> encoder = VideoEncoder::Create(VideoOptions(
      picture.cols, picture.rows, frame.tracked.camera->intrinsics().fps, bit_rate_bit_s_));
  if (!encoder.ok()) return encoder.status();
  encoder_ = *std::move(encoder);
  return absl::OkStatus();
}

/// A computer that cannot keep up codes fewer pictures than the camera takes; each gets more bits.
void ViewEncoder::TellFrameRate(Timestamp now_ns) {
  ++coded_;
  const Timestamp elapsed_ns = now_ns - rate_told_ns_;
  if (elapsed_ns < kRateInterval) return;
  // Longer: nobody watched, or the source stood still.
  if (elapsed_ns < 2 * kRateInterval) encoder_->SetFrameRate(coded_ / Seconds(elapsed_ns));
  rate_told_ns_ = now_ns;
  coded_ = 0;
}

absl::StatusOr<EncodedPicture> ViewEncoder::DrawAndCode(const TrackedFrame& frame) {
  try {
    const cv::Mat picture = draw_(frame);
    if (absl::Status ready = Prepare(picture, frame); !ready.ok()) return ready;
    TellFrameRate(MonotonicNow());
    return encoder_->Encode(picture, TakeKeyFrameRequest(MonotonicNow()));
  } catch (const std::exception& error) {  // no memory, or what OpenCV will not draw
    return absl::InternalError(error.what());
  }
}

void ViewEncoder::Step(const TrackedFrame& frame) {
  if (!may_show_(frame.frame->id)) return;
  const Timestamp begin_ns = MonotonicNow();
  const absl::StatusOr<EncodedPicture> coded = DrawAndCode(frame);
  if (!coded.ok()) {
    if (!failed_) Log(absl::StrCat("video: ", coded.status().ToString()));
    failed_ = true;
    return;
  }
  failed_ = false;
  auto packet = std::make_shared<VideoPacket>();
  packet->view = view_;
  packet->sequence = ++sequence_;
  packet->key_frame = coded->key_frame;
  packet->temporal_layer = coded->temporal_layer;
  packet->data = coded->data;
  packet->width = encoder_->coded_width();
  packet->height = encoder_->coded_height();
  packet->tracked = frame.tracked;
  const Timestamp end_ns = MonotonicNow();
  packet->tracked.stages.encoded_ns = end_ns;
  milliseconds_.Add(end_ns, 1e-6 * static_cast<double>(end_ns - begin_ns));
  bits_.Add(end_ns, 8.0 * static_cast<double>(coded->data->size()));
  sink_.OnVideo(packet);
}

}  // namespace saccade
