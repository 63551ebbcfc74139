#include "server/capture/dataset.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "server/capture/dataset_layout.hpp"
#include "server/capture/frame_decoder.hpp"
#include "server/capture/gap.hpp"
#include "server/capture/image_list.hpp"
#include "server/capture/imu_file.hpp"
#include "server/capture/picture_size.hpp"
#include "server/capture/target_file.hpp"
#include "server/capture/uri_query.hpp"
#include "shared/io/log.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

// While no file descriptor is free: how often to look, and how often to say so.
constexpr std::chrono::milliseconds kLookAgain(200);
constexpr Timestamp kSayAgain_ns = 5'000'000'000;
constexpr Timestamp kLongestPause_ns = 5'000'000'000;  // in real time: nobody waits for an hour
constexpr int kPausesTold = 3;

class DatasetSource : public FrameSource {
 public:
  DatasetSource(SourceInfo info, FrameDecoder decoder, std::uint64_t first, std::uint64_t end)
      : decoder_(std::move(decoder)), next_(first), end_(end), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  std::uint64_t bad_frames() const override { return bad_frames_; }

 protected:
  /// The picture, or nothing if it is bad (then counted and named) or the reader was stopped.
  /// Waits while no file descriptor is free: that says nothing about the picture.
  std::optional<Frame> DecodeOrReport(std::uint64_t index) {
    absl::StatusOr<Frame> frame = decoder_.Decode(index);
    const Timestamp begin = MonotonicNow();
    for (Timestamp told = 0; absl::IsResourceExhausted(frame.status());
         frame = decoder_.Decode(index)) {
      if (told == 0 || MonotonicNow() - told > kSayAgain_ns) {
        told = MonotonicNow();
        Log(absl::StrCat("frame ", index, " waits: ", frame.status().message()));
      }
      std::unique_lock lock(mutex_);
      if (changed_.wait_for(lock, kLookAgain, [this] { return stopped_; })) return std::nullopt;
      waited_ns_ = MonotonicNow() - begin;
    }
    if (frame.ok()) return *std::move(frame);
    ++bad_frames_;
    Log(absl::StrCat("frame ", index, " skipped: ", frame.status().message()));
    return std::nullopt;
  }
  /// How long the last DecodeOrReport waited for a descriptor; since then not asked.
  Timestamp TakeWaited() { return std::exchange(waited_ns_, 0); }

  const FrameDecoder decoder_;
  std::uint64_t next_;
  const std::uint64_t end_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool stopped_ = false;  // guarded by mutex_

 private:
  Timestamp waited_ns_ = 0;  // reading thread
  const SourceInfo info_;
  std::atomic<std::uint64_t> bad_frames_ = 0;
};

/// Delivers every frame; a thread decodes ahead in order, so the result does not depend on timing.
class EveryFrameSource final : public DatasetSource {
 public:
  using DatasetSource::DatasetSource;
  ~EveryFrameSource() override { Stop(); }

  absl::StatusOr<std::optional<Frame>> Next() override {
    std::unique_lock lock(mutex_);
    if (!reader_.joinable() && !stopped_) {
      reader_ = std::jthread([this](std::stop_token stop) { ReadAhead(stop); });
    }
    changed_.wait(lock, [this] { return stopped_ || done_ || !ready_.empty(); });
    if (stopped_ || ready_.empty()) return std::nullopt;
    std::optional<Frame> frame = std::move(ready_.front());
    ready_.pop_front();
    changed_.notify_all();
    frame->received_time_ns = MonotonicNow();
    return frame;
  }

  void Stop() override {
    std::lock_guard lock(mutex_);
    stopped_ = true;
    reader_.request_stop();
    changed_.notify_all();
  }

 private:
  void ReadAhead(std::stop_token stop) {
    for (; next_ < end_ && !stop.stop_requested(); ++next_) {
      std::optional<Frame> frame = DecodeOrReport(next_);
      if (!frame) continue;
      std::unique_lock lock(mutex_);
      const auto room = [this] { return ready_.size() < decoder_.read_ahead(); };
      if (!changed_.wait(lock, stop, room)) return;
      ready_.push_back(*std::move(frame));
      changed_.notify_all();
    }
    std::lock_guard lock(mutex_);
    done_ = true;
    changed_.notify_all();
  }

  std::deque<Frame> ready_;  // guarded by mutex_
  bool done_ = false;        // guarded by mutex_
  std::jthread reader_;      // last: joins before the rest goes
};

/// Delivers frames when they are due, as the camera would have.
class RealtimeSource final : public DatasetSource {
 public:
  RealtimeSource(SourceInfo info, FrameDecoder decoder, std::uint64_t first, std::uint64_t end)
      : DatasetSource(std::move(info), std::move(decoder), first, end), first_(first) {
    Timestamp before_ns = decoder_.entries()[first].time_ns, at_ns = before_ns;
    for (std::uint64_t index = first; index < end; ++index) {
      const Timestamp time_ns = decoder_.entries()[index].time_ns;
      at_ns += std::min(time_ns - std::exchange(before_ns, time_ns), kLongestPause_ns);
      times_ns_.push_back(at_ns);
    }
  }

  absl::StatusOr<std::optional<Frame>> Next() override {
    if (!started_) {
      started_ = true;
      origin_ns_ = MonotonicNow() - TimeOf(next_);
    }
    while (next_ < end_) {
      const Timestamp now = MonotonicNow();
      while (next_ + 1 < end_ && DueAt(next_ + 1) <= now) ++next_;  // late: the newest wins
      const std::uint64_t index = next_++;
      std::optional<Frame> frame = DecodeOrReport(index);
      origin_ns_ += TakeWaited();  // the recording stood still: nothing of it is left out
      if (!frame && Stopped()) return std::nullopt;
      if (!frame) continue;
      if (!WaitUntil(DueAt(index))) return std::nullopt;
      frame->received_time_ns = MonotonicNow();
      return frame;
    }
    return std::nullopt;
  }

  void Stop() override {
    std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }

 private:
  Timestamp TimeOf(std::uint64_t index) const { return times_ns_[index - first_]; }
  Timestamp DueAt(std::uint64_t index) const { return origin_ns_ + TimeOf(index); }

  bool Stopped() {
    const std::lock_guard lock(mutex_);
    return stopped_;
  }
  /// False if stopped.
  bool WaitUntil(Timestamp due_ns) {
    const std::chrono::steady_clock::time_point due{std::chrono::nanoseconds(due_ns)};
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, due, [this] { return stopped_; });
    return !stopped_;
  }

  const std::uint64_t first_;
  std::vector<Timestamp> times_ns_;  // by the recording's clock, without the rest of long pauses
  bool started_ = false;
  Timestamp origin_ns_ = 0;  // steady clock minus capture clock
};

/// Target, start pose and inertial samples, where the folder has them.
absl::Status ReadFacts(const std::filesystem::path& folder, std::uint64_t first_frame,
                       SourceInfo* info) {
  if (MayExist(folder / "target.yaml")) {
    absl::StatusOr<Target> target = LoadTarget(folder / "target.yaml");
    if (!target.ok()) return target.status();
    auto* board = std::get_if<ChessboardTarget>(&*target);
    if (board != nullptr && first_frame > 0) board->hint_px.reset();
    info->target = *std::move(target);
  }
  if (MayExist(folder / "start.yaml")) {
    absl::StatusOr<StartPose> start = LoadStart(folder / "start.yaml");
    if (!start.ok()) return start.status();
    if (first_frame == 0) info->start = *start;
  }
  absl::StatusOr<std::shared_ptr<ImuFeed>> imu = LoadImu(folder);
  if (!imu.ok()) return imu.status();
  info->imu = *std::move(imu);
  return absl::OkStatus();
}

/// Where the recording pauses, and what that means, on stderr.
void TellPauses(const std::filesystem::path& list, const std::vector<ImageEntry>& entries,
                std::uint64_t first, std::uint64_t end) {
  int pauses = 0;
  for (std::uint64_t i = first + 1; i < end; ++i) {
    if (!IsGap(entries[i - 1].time_ns, entries[i].time_ns) || ++pauses > kPausesTold) continue;
    Log(absl::StrFormat(
        "%s:%d: a pause of %.6g s (time stamps are seconds) before frame %d: "
        "tracking starts anew there",
        list.string(), entries[i].line, Seconds(entries[i].time_ns - entries[i - 1].time_ns), i));
  }
  if (pauses > kPausesTold) {
    Log(absl::StrCat(list.string(), ": ", pauses - kPausesTold, " more pauses of above ",
                     Seconds(kLongestGap_ns), " s"));
  }
}

/// A wrong size in camera.yaml is told at once, by the first picture that can be read at all.
absl::Status CheckFirstPicture(const FrameDecoder& decoder, std::uint64_t first,
                               std::uint64_t end) {
  constexpr std::uint64_t kTries = 50;
  absl::Status last;
  for (std::uint64_t i = first; i < std::min(end, first + kTries); ++i) {
    last = decoder.Decode(i).status();
    // No descriptor is free: the next picture would not be read either.
    if (last.ok() || absl::IsInvalidArgument(last) || absl::IsResourceExhausted(last)) return last;
  }
  return absl::DataLossError(absl::StrCat("no picture can be decoded; ", last.message()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameSource>> OpenDataset(const std::filesystem::path& folder,
                                                         const SourceOptions& options) {
  absl::StatusOr<DatasetLayout> layout = ReadDatasetLayout(folder, options);
  if (!layout.ok()) return layout.status();
  const std::uint64_t count = layout->entries.size();
  const std::uint64_t end = std::min(options.end_frame.value_or(count), count);
  if (options.first_frame >= end) {
    return absl::InvalidArgumentError(absl::StrCat("frames ", options.first_frame, ":",
                                                   options.end_frame.value_or(count), " is empty; ",
                                                   folder.string(), " has frames 0:", count));
  }
  SourceInfo info;
  info.uri = absl::StrCat("dataset:", folder.string());
  info.remark = layout->remark;
  info.lens_assumed = layout->lens_assumed;
  if (!info.remark.empty()) Log(absl::StrCat("source ", info.uri, ": ", info.remark));
  info.camera = std::make_shared<const CameraModel>(layout->camera);
  info.frame_count = end - options.first_frame;
  if (const absl::Status status = ReadFacts(folder, options.first_frame, &info); !status.ok()) {
    return status;
  }
  TellPauses(layout->list, layout->entries, options.first_frame, end);
  FrameDecoder decoder(layout->pictures, std::move(layout->entries), info.camera,
                       layout->camera_file);
  if (const absl::Status status = CheckFirstPicture(decoder, options.first_frame, end);
      !status.ok()) {
    return status;
  }
  if (options.realtime) {
    return std::make_unique<RealtimeSource>(std::move(info), std::move(decoder),
                                            options.first_frame, end);
  }
  return std::make_unique<EveryFrameSource>(std::move(info), std::move(decoder),
                                            options.first_frame, end);
}

absl::StatusOr<std::unique_ptr<FrameSource>> OpenDatasetUri(absl::string_view rest,
                                                            const SourceOptions& options) {
  const std::filesystem::path whole{std::string(rest)};
  if (rest.find('?') == absl::string_view::npos || MayExist(whole)) {
    return OpenDataset(whole, options);  // also a folder with a question mark in its name
  }
  UriQuery query("dataset:", rest);
  SourceOptions with_rate = options;
  if (const std::optional<double> fps = query.Number("fps", 0.1, 1000)) with_rate.fps = fps;
  if (const std::optional<double> view_deg = query.Number("fov", 10, 150)) {
    with_rate.view_deg = view_deg;
  }
  if (const absl::Status status = query.Finish("fps and fov"); !status.ok()) return status;
  return OpenDataset(query.path(), with_rate);
}

}  // namespace saccade
