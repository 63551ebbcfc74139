#pragma once

#include <absl/status/statusor.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "server/capture/stream_clock.hpp"
#include "server/capture/turned_picture.hpp"
#include "server/capture/video/decoder_process.hpp"
#include "server/capture/video/frame_queue.hpp"
#include "server/capture/video/video_source.hpp"

namespace saccade {

/// What a URI asks for.
struct VideoRequest {
  VideoInput input;
  std::int64_t start_ns = 0;
  Turn turn;
  bool turn_by_file = true;  // as the file says, unless it was asked for otherwise
  Pace pace = Pace::kEvery;
  std::uint64_t first = 0;
  std::optional<std::uint64_t> end;

  bool live() const { return pace == Pace::kNewest; }
};

/// A decoder that has said what it decodes.
struct OpenedDecoder {
  std::unique_ptr<DecoderProcess> process;
  DecodeHeader info;
  std::string codec;
};

/// Starts one and waits for its first word, ten seconds at most.
///   InvalidArgument  no video; its own words
///   others           as DecoderProcess
absl::StatusOr<OpenedDecoder> OpenDecoder(const VideoInput& input, std::int64_t after_ns,
                                          const std::function<bool()>& stopped);

/// Frames of a decoder, which is started anew when it dies. A thread of its own reads them.
class DecodedSource final : public VideoSource {
 public:
  DecodedSource(VideoRequest request, SourceInfo info, OpenedDecoder decoder);
  ~DecodedSource() override { Stop(); }

  const SourceInfo& info() const override { return info_; }
  std::uint64_t bad_frames() const override { return bad_; }
  std::uint64_t dropped_frames() const override { return queue_.dropped(); }
  pid_t decoder_pid() const override { return pid_; }
  std::uint64_t decoder_restarts() const override { return restarts_; }
  absl::StatusOr<std::optional<Frame>> Next() override;
  void Stop() override;

 private:
  // The reading thread.
  void Run(const std::stop_token& stop);
  /// A new decoder behind the last frame.
  absl::Status Restart();
  /// One message of the decoder at work. Cancelled: stopped; else it is of no more use.
  absl::Status ReadOn(const std::stop_token& stop);
  absl::Status TakeFrame(const DecodeHeader& header, const std::stop_token& stop);
  bool Deliver(DecodedPicture picture, std::int64_t time_ns, const std::stop_token& stop);
  /// After a death: OK to go on. Waits a little, longer each time.
  absl::Status Judge(const absl::Status& death, const std::stop_token& stop);
  std::function<bool()> Stopped();

  const VideoRequest request_;
  const SourceInfo info_;
  const cv::Size size_;
  std::atomic<std::uint64_t> bad_ = 0, restarts_ = 0;
  std::atomic<pid_t> pid_ = 0;
  std::mutex mutex_;
  absl::Status failed_;  // guarded by mutex_

  // Reading thread.
  std::unique_ptr<DecoderProcess> process_;  // null: to be started
  StreamClock clock_;
  FrameId next_id_ = 0;
  std::int64_t after_ns_ = -1;
  Timestamp last_capture_ns_ = 0, told_ns_ = 0;
  std::uint64_t bad_of_process_ = 0;
  int deaths_ = 0, attempts_ = 0;  // since the last frame: for which the video is to blame; all
  bool ended_ = false;

  FrameQueue queue_;
  std::jthread reader_;  // last: joins before the rest goes
};

}  // namespace saccade
