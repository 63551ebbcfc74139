#include "server/capture/video/decoded_source.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "server/capture/euroc_list.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kOpening(10'000);
constexpr milliseconds kFileHangs(2'000), kStreamHangs(5'000);
constexpr milliseconds kDecoderRetry(100), kMostDecoderRetry(2'000);
constexpr int kMostDeaths = 6;                      // one after the other, of a file
constexpr std::int64_t kLeaveOut_ns = 500'000'000;  // where decoders die
constexpr Timestamp kTellDecoderAgain_ns = 5'000'000'000;
constexpr std::size_t kReadAhead = 4;       // frames
constexpr std::size_t kMostReadAhead = 45;  // 1.5 s: what a new decoder may take to get there
constexpr std::size_t kReadAheadBytes = std::size_t{64} << 20;

std::size_t ReadAhead(Pace pace, const DecodeHeader& info) {
  if (pace != Pace::kDue) return kReadAhead;
  const std::size_t bytes = std::size_t{4} * info.width * info.height;
  return std::clamp(kReadAheadBytes / bytes, kReadAhead, kMostReadAhead);
}

}  // namespace

absl::StatusOr<OpenedDecoder> OpenDecoder(const VideoInput& input, std::int64_t after_ns,
                                          const std::function<bool()>& stopped) {
  absl::StatusOr<std::unique_ptr<DecoderProcess>> process = DecoderProcess::Start(input, after_ns);
  if (!process.ok()) return process.status();
  const absl::StatusOr<DecodeHeader> header = (*process)->ReadHeader(stopped, kOpening);
  if (!header.ok()) return header.status();
  absl::StatusOr<std::string> text = (*process)->ReadText(*header, stopped);
  if (!text.ok()) return text.status();
  if (header->kind == DecodeHeader::kError) return absl::InvalidArgumentError(*text);
  const bool possible = header->kind == DecodeHeader::kInfo && header->width >= 16 &&
                        header->height >= 16 && header->width <= kMaxPictureSide_px &&
                        header->height <= kMaxPictureSide_px;
  if (!possible) {
    return absl::InvalidArgumentError(absl::StrCat("its pictures are ", header->width, "x",
                                                   header->height, "; 16 to ", kMaxPictureSide_px,
                                                   " px a side are read"));
  }
  return OpenedDecoder{*std::move(process), *header, *std::move(text)};
}

DecodedSource::DecodedSource(VideoRequest request, SourceInfo info, OpenedDecoder decoder)
    : request_(std::move(request)),
      info_(std::move(info)),
      size_(static_cast<int>(decoder.info.width), static_cast<int>(decoder.info.height)),
      process_(std::move(decoder.process)),
      queue_(request_.pace, ReadAhead(request_.pace, decoder.info)) {
  pid_ = process_->pid();
  reader_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

absl::StatusOr<std::optional<Frame>> DecodedSource::Next() {
  std::optional<Frame> frame = queue_.Take();
  if (frame || queue_.stopped()) return frame;
  const std::lock_guard lock(mutex_);
  if (!failed_.ok()) return failed_;
  return std::nullopt;
}

void DecodedSource::Stop() {
  queue_.Stop();
  reader_.request_stop();
}

void DecodedSource::Run(const std::stop_token& stop) {
  while (!ended_ && !stop.stop_requested()) {
    const absl::Status read = process_ == nullptr ? Restart() : ReadOn(stop);
    if (read.ok()) continue;
    if (absl::IsCancelled(read)) break;
    process_.reset();
    pid_ = 0;
    if (const absl::Status give_up = Judge(read, stop); !give_up.ok()) {
      const std::lock_guard lock(mutex_);
      failed_ = give_up;
      break;
    }
  }
  process_.reset();
  pid_ = 0;
  queue_.End();
}

std::function<bool()> DecodedSource::Stopped() {
  return [this] { return queue_.stopped(); };
}

absl::Status DecodedSource::Restart() {
  absl::StatusOr<OpenedDecoder> decoder =
      OpenDecoder(request_.input, request_.live() ? -1 : after_ns_, Stopped());
  if (!decoder.ok()) return decoder.status();
  ++restarts_;
  process_ = std::move(decoder->process);
  pid_ = process_->pid();
  bad_of_process_ = 0;
  clock_.Reset();
  return absl::OkStatus();
}

absl::Status DecodedSource::ReadOn(const std::stop_token& stop) {
  const absl::StatusOr<DecodeHeader> header =
      process_->ReadHeader(Stopped(), request_.live() ? kStreamHangs : kFileHangs);
  if (!header.ok()) return header.status();
  bad_ += header->bad > bad_of_process_ ? header->bad - bad_of_process_ : 0;
  bad_of_process_ = std::max(bad_of_process_, header->bad);
  switch (header->kind) {
    case DecodeHeader::kAlive:
      return absl::OkStatus();
    case DecodeHeader::kFrame:
      return TakeFrame(*header, stop);
    case DecodeHeader::kEnd:
      if (request_.live()) return absl::UnavailableError("the stream has ended");
      ended_ = true;
      return absl::OkStatus();
    default:
      break;
  }
  const absl::StatusOr<std::string> text = process_->ReadText(*header, Stopped());
  return text.ok() ? absl::UnavailableError(*text) : text.status();
}

absl::Status DecodedSource::TakeFrame(const DecodeHeader& header, const std::stop_token& stop) {
  const bool colour = header.channels == 3;
  const bool fits = header.width <= kMaxPictureSide_px && header.height <= kMaxPictureSide_px &&
                    (colour || header.channels == 1) &&
                    header.size == std::size_t{header.width} * header.height * header.channels;
  if (!fits) return absl::UnavailableError("the decoder writes nonsense");
  DecodedPicture picture;
  try {
    cv::Mat pixels(static_cast<int>(header.height), static_cast<int>(header.width),
                   colour ? CV_8UC3 : CV_8UC1);
    const absl::Status read = process_->ReadBytes(pixels.data, header.size, Stopped());
    if (!read.ok()) return read;
    if (pixels.size() != size_) {  // a stream may change its size, a map cannot
      ++bad_;
      return absl::OkStatus();
    }
    if (colour) {
      cv::cvtColor(pixels, picture.grey, cv::COLOR_BGR2GRAY);
      picture.color = pixels;
    } else {
      picture.grey = pixels;
    }
    picture = Turned(std::move(picture), request_.turn);
  } catch (const std::exception& e) {  // no memory
    return absl::UnavailableError(absl::StrCat("a frame cannot be kept (", e.what(), ")"));
  }
  deaths_ = attempts_ = 0;
  after_ns_ = header.time_ns;
  if (!Deliver(std::move(picture), header.time_ns, stop)) return absl::CancelledError("");
  return absl::OkStatus();
}

bool DecodedSource::Deliver(DecodedPicture picture, std::int64_t time_ns,
                            const std::stop_token& stop) {
  Frame frame;
  frame.id = next_id_++;
  if (frame.id < request_.first) return true;
  if (request_.end && frame.id >= *request_.end) {
    ended_ = true;
    return true;
  }
  frame.received_time_ns = MonotonicNow();
  if (request_.live()) {
    frame.capture_time_ns = clock_.ToMonotonic(time_ns, frame.received_time_ns);
    if (frame.capture_time_ns <= last_capture_ns_) return true;
    last_capture_ns_ = frame.capture_time_ns;
  } else {
    frame.capture_time_ns = request_.start_ns + time_ns;
    frame.source_timestamp = EurocSeconds(frame.capture_time_ns);
  }
  frame.grey = std::move(picture.grey);
  frame.color = std::move(picture.color);
  frame.camera = info_.camera;
  return queue_.Put(std::move(frame), stop);
}

absl::Status DecodedSource::Judge(const absl::Status& death, const std::stop_token& stop) {
  const bool live = request_.live();
  const bool killed = absl::IsAborted(death);
  // Killed by others, or out of descriptors: that says nothing about the video.
  const bool blamed = !live && !killed && !absl::IsResourceExhausted(death);
  ++attempts_;
  if (blamed) ++deaths_;
  const std::string where =
      live ? "" : absl::StrFormat(" at %.3f s", Seconds(std::max<Timestamp>(after_ns_, 0)));
  if (attempts_ == 1 || MonotonicNow() - told_ns_ > kTellDecoderAgain_ns) {
    told_ns_ = MonotonicNow();
    Log(absl::StrCat("source ", info_.uri, where, ": ", death.message(), "; started anew"));
  }
  if (deaths_ > kMostDeaths) {
    return absl::DataLossError(absl::StrCat(
        request_.input.name(), where, ": the decoder ends again and again (", death.message(),
        "); the file may be damaged there: cut it, or convert it anew"));
  }
  if (blamed && deaths_ > 1) {  // it is this place
    after_ns_ = std::max<std::int64_t>(after_ns_, 0) + kLeaveOut_ns;
    ++bad_;
  }
  if (attempts_ <= (killed ? 3 : 1) && !absl::IsResourceExhausted(death)) return absl::OkStatus();
  const milliseconds wait =
      killed ? kDecoderRetry : std::min(attempts_ * kDecoderRetry, kMostDecoderRetry);
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, wait, [] { return false; });
  return absl::OkStatus();
}

}  // namespace saccade
