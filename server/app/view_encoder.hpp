#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "server/capture/frame.hpp"
#include "server/encode/video_encoder.hpp"
#include "server/pipeline/events.hpp"
#include "server/pipeline/rolling_statistics.hpp"
#include "server/pipeline/runner.hpp"

namespace saccade {

/// A frame with all that is known of it, on its way to the encoder.
struct TrackedFrame {
  std::shared_ptr<const Frame> frame;
  TrackedEvent tracked;
};

/// In colour where there is colour.
inline const cv::Mat& PictureOf(const Frame& frame) {
  return frame.color.empty() ? frame.grey : frame.color;
}

/// How a view of this size is coded. The encoder takes 1 to 240 pictures a second; a camera outside
/// that is coded as if at the nearest.
VideoEncoderOptions VideoOptions(int width, int height, double fps_hz, int bit_rate_bit_s);

/// The picture of one view. Any thread.
using DrawView = std::function<cv::Mat(const TrackedFrame&)>;
/// Whether the frame may be seen now. Any thread.
using MayShow = std::function<bool(FrameId)>;

/// Draws and codes one view on a thread of its own, once for all who watch and only while somebody
/// does. A frame that finds the encoder busy replaces the one that waits.
class ViewEncoder {
 public:
  /// `sink` hears of each packet on the encoder's thread. `bit_rate_bit_s` 0: the encoder's
  /// default.
  /// Frames that may not be shown are not coded.
  ViewEncoder(VideoView view, int bit_rate_bit_s, DrawView draw, MayShow may_show, EventSink& sink);
  ~ViewEncoder() { Stop(); }
  void Stop() { runner_.Stop(); }

  // Any thread; none blocks.
  void Post(TrackedFrame frame);
  /// The newest frame once more, with what is known of it now. While frames come the next one shows
  /// it; else it is coded again, at most four times a second: commands never cause video.
  void Redraw(TrackedFrame frame);
  /// What is drawn into the newest frame changed: as Redraw.
  void RedrawNewest();
  /// Once a second: what was put off.
  void Tick();
  void SetDemand(bool wanted);
  /// The next picture becomes a key frame, at most four times a second; if no frame comes, because
  /// the source ended or stands still, the last one is coded again.
  void RequestKeyFrame();
  /// Pictures may be shown again: the next frame has time to come before the last one is coded
  /// anew.
  void AwaitFrame();

  RollingStatistics::Summary milliseconds() const { return milliseconds_.At(MonotonicNow()); }
  double bit_rate_bit_s() const { return bits_.At(MonotonicNow()).sum_per_second; }

 private:
  absl::StatusOr<EncodedPicture> DrawAndCode(const TrackedFrame& frame);
  void Step(const TrackedFrame& frame);
  /// Codes the newest frame once more if no other comes and the last time is long enough ago.
  void PostAgain();
  bool TakeKeyFrameRequest(Timestamp now_ns);
  void TellFrameRate(Timestamp now_ns);
  absl::Status Prepare(const cv::Mat& picture, const TrackedFrame& frame);

  const VideoView view_;
  const int bit_rate_bit_s_;
  const DrawView draw_;
  const MayShow may_show_;
  EventSink& sink_;
  RollingStatistics milliseconds_;  // to draw and code one picture
  RollingStatistics bits_;
  std::atomic<bool> wanted_ = false;
  std::atomic<bool> key_requested_ = false;
  std::atomic<bool> redraw_due_ = false;

  std::mutex mutex_;
  std::optional<TrackedFrame> last_;  // posted, coded or not
  Timestamp posted_ns_ = 0;
  Timestamp again_ns_ = 0;  // when it was last coded once more

  // The runner's thread only.
  std::unique_ptr<VideoEncoder> encoder_;
  std::uint64_t sequence_ = 0;
  Timestamp key_ns_ = 0;
  Timestamp rate_told_ns_ = 0;
  int coded_ = 0;        // since then
  bool failed_ = false;  // said so once

  Runner<TrackedFrame> runner_;  // last
};

}  // namespace saccade
