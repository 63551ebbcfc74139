#include "server/capture/phone/phone_source.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "server/capture/assumed_lens.hpp"
#include "server/capture/camera_file.hpp"
#include "server/capture/turned_picture.hpp"
#include "server/capture/uri_query.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr Timestamp kAskAgain_ns = 250'000'000;
constexpr Timestamp kTellAgain_ns = 5'000'000'000;
constexpr std::chrono::milliseconds kRetry(250), kMostRetry(4'000);
constexpr Timestamp kMotionKept_ns = 2'000'000'000;
constexpr std::size_t kPicturesKept = 64, kMotionMost = 400;
constexpr int kLeastSide_px = 160, kMostSide_px = 1920;

absl::StatusOr<std::optional<cv::Size>> ReadSize(UriQuery& query) {
  const std::optional<std::string> text = query.Text("size");
  if (!text) return std::nullopt;
  const std::vector<std::string> sides = absl::StrSplit(*text, 'x');
  cv::Size size;
  const bool good = sides.size() == 2 && absl::SimpleAtoi(sides[0], &size.width) &&
                    absl::SimpleAtoi(sides[1], &size.height) && size.width % 2 == 0 &&
                    size.height % 2 == 0 && std::min(size.width, size.height) >= kLeastSide_px &&
                    std::max(size.width, size.height) <= kMostSide_px;
  if (good) return size;
  query.Fail("size", absl::StrCat("'", *text, "': give WxH in even pixels from ", kLeastSide_px,
                                  " to ", kMostSide_px, ", for example 640x480"));
  return std::nullopt;
}

absl::Status CheckLive(const std::string& uri, const SourceOptions& options) {
  if (options.first_frame > 0 || options.end_frame || options.fps) {
    return absl::InvalidArgumentError(absl::StrCat(
        "source ", uri, ": a phone has no range of frames, and its rate is written ?fps=N"));
  }
  if (options.realtime) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("source ", uri, ": a phone waits for nobody: leave --speed max out"));
}

std::string OfAnotherSize(cv::Size came, cv::Size taken) {
  return absl::StrCat("pictures of ", came.width, "x", came.height, " came, and this server takes ",
                      taken.width, "x", taken.height);
}

}  // namespace

absl::StatusOr<std::unique_ptr<PhoneSource>> PhoneSource::Open(absl::string_view rest,
                                                               const SourceOptions& options) {
  SourceInfo info;
  info.uri = absl::StrCat("phone:", rest);
  if (absl::Status live = CheckLive(info.uri, options); !live.ok()) return live;
  UriQuery query("phone:", rest);
  const absl::StatusOr<std::optional<cv::Size>> asked = ReadSize(query);
  const double fps = query.Number("fps", 5, 60).value_or(30);
  if (absl::Status known = query.Finish("size and fps"); !known.ok()) return known;
  if (!query.path().empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "source ", info.uri, ": names no device: write phone: or phone:?size=640x480&fps=30"));
  }
  cv::Size size = asked->value_or(cv::Size(640, 480));
  CameraIntrinsics lens = AssumedLens(size, size.height > size.width, fps);
  if (options.camera_file.empty()) {
    info.remark = AssumedLensWords();
    info.lens_assumed = true;
    Log(absl::StrCat("source ", info.uri, ": ", AssumedLensWords()));
  } else {
    const absl::StatusOr<CameraIntrinsics> read =
        LoadCamera(options.camera_file, [&] { return *asked; });
    if (!read.ok()) return read.status();
    lens = *read;
    lens.fps = fps;
    if (*asked && (lens.width != size.width || lens.height != size.height)) {
      return absl::InvalidArgumentError(absl::StrCat(
          options.camera_file.string(), ": is of pictures of ", lens.width, "x", lens.height,
          ", and size asks for ", size.width, "x", size.height, "; leave size out"));
    }
    size = cv::Size(lens.width, lens.height);
  }
  info.camera = std::make_shared<const CameraModel>(lens);
  return std::unique_ptr<PhoneSource>(new PhoneSource(std::move(info), size));
}

PhoneSource::PhoneSource(SourceInfo info, cv::Size size)
    : info_(std::move(info)), size_(size), decoder_(size, [this] { return frames_.stopped(); }) {
  reader_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

absl::StatusOr<std::optional<Frame>> PhoneSource::Next() { return frames_.Take(); }

void PhoneSource::Stop() {
  frames_.Stop();
  reader_.request_stop();
}

// --- The link's side
// ------------------------------------------------------------------------------

void PhoneSource::Begin(std::shared_ptr<PhoneLink> link) {
  const std::lock_guard lock(mutex_);
  link_ = std::move(link);
  ++generation_;
  waiting_.clear();
  pictures_.clear();
  motion_.clear();
  needs_key_ = true;
  asked_ns_ = MonotonicNow();  // it begins with one
  told_ns_ = 0;
  counts_ = {};
  clock_.Reset();
}

void PhoneSource::End(const PhoneLink* link) {
  const std::lock_guard lock(mutex_);
  if (link_.get() != link) return;
  link_.reset();
  waiting_.clear();
}

void PhoneSource::Offer(const PhoneLink* link, CodedPicture picture) {
  const std::lock_guard lock(mutex_);
  if (link_.get() != link) return;
  // Nothing before a key frame is needed for what follows it.
  if (picture.key_frame || waiting_.size() >= kMostWaiting) {
    counts_.dropped += waiting_.size();
    dropped_ += waiting_.size();
    next_id_ += waiting_.size();
    needs_key_ = needs_key_ || !waiting_.empty();
    waiting_.clear();
  }
  picture.generation = generation_;
  waiting_.push_back(std::move(picture));
  changed_.notify_all();
}

void PhoneSource::AddPing(const PhoneLink* link, Timestamp server_sent_ns,
                          Timestamp phone_arrived_ns, Timestamp phone_sent_ns,
                          Timestamp server_arrived_ns) {
  const std::lock_guard lock(mutex_);
  if (link_.get() != link) return;
  clock_.Add(server_sent_ns, phone_arrived_ns, phone_sent_ns, server_arrived_ns);
}

void PhoneSource::AddMotion(const PhoneLink* link, Timestamp phone_ns, MotionSample sample) {
  const bool finite =
      sample.acceleration_m_s2.allFinite() && sample.angular_velocity_rad_s.allFinite();
  const std::lock_guard lock(mutex_);
  const std::optional<Timestamp> time_ns = clock_.At(phone_ns);
  if (link_.get() != link || !finite || !time_ns) return;
  sample.time_ns = *time_ns;
  if (!motion_.empty() && sample.time_ns <= motion_.back().time_ns) return;
  ++counts_.motion;
  motion_.push_back(sample);
  while (motion_.size() > kMotionMost ||
         motion_.front().time_ns < sample.time_ns - kMotionKept_ns) {
    motion_.pop_front();
  }
}

std::optional<PhonePicture> PhoneSource::Find(FrameId frame) const {
  const std::lock_guard lock(mutex_);
  for (auto at = pictures_.rbegin(); at != pictures_.rend(); ++at) {
    if (at->frame_id == frame) return *at;
  }
  return std::nullopt;
}

PhoneCounts PhoneSource::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::deque<MotionSample> PhoneSource::motion() const {
  const std::lock_guard lock(mutex_);
  return motion_;
}

// --- The decoding thread
// --------------------------------------------------------------------------

void PhoneSource::Run(const std::stop_token& stop) {
  while (std::optional<CodedPicture> packet = Take(stop)) {
    try {
      Decode(*packet, stop);
    } catch (const std::exception& e) {  // no memory
      LogSeldom(absl::StrCat("phone: a picture cannot be kept (", e.what(), ")"));
      NeedKeyFrame(packet->generation);
    }
  }
}

std::optional<CodedPicture> PhoneSource::Take(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    CodedPicture packet = std::move(waiting_.front());
    waiting_.pop_front();
    if (packet.key_frame || !needs_key_) {
      anew_ = needs_key_;
      needs_key_ = false;
      return packet;
    }
    ++dropped_;
    ++counts_.dropped;
    ++next_id_;
    const std::shared_ptr<PhoneLink> link = link_;
    const bool ask = link && MonotonicNow() - asked_ns_ > kAskAgain_ns;
    if (!ask) continue;
    asked_ns_ = MonotonicNow();
    lock.unlock();
    link->WantKeyFrame();
    lock.lock();
  }
  return std::nullopt;
}

void PhoneSource::WaitAfterDeath(const std::stop_token& stop) {
  retry_ = std::clamp(2 * retry_, kRetry, kMostRetry);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, retry_, [] { return false; });
}

void PhoneSource::LogSeldom(const std::string& text) {
  const Timestamp now_ns = MonotonicNow();
  if (logged_ns_ != 0 && now_ns - logged_ns_ < kTellAgain_ns) return;
  logged_ns_ = now_ns;
  Log(text);
}

void PhoneSource::Decode(const CodedPicture& packet, const std::stop_token& stop) {
  // Another phone, or a page that was loaded anew: both count from 1 again.
  if (!sent_.empty() && sent_.back().generation != packet.generation) sent_.clear();
  sent_.push_back({packet.picture_id, packet.codec, packet.key_frame, packet.capture_ns,
                   packet.clockwise_deg, "", packet.received_ns, packet.generation});
  if (sent_.size() > kMostWaiting) sent_.pop_front();
  absl::StatusOr<DecodedPacket> decoded = decoder_.Decode(packet, anew_);
  if (stop.stop_requested()) return;
  if (!decoded.ok()) {
    if (absl::IsCancelled(decoded.status())) return;
    LogSeldom(
        absl::StrCat("phone: ", decoded.status().message(), "; decoding goes on with a new one"));
    NeedKeyFrame(packet.generation);
    return WaitAfterDeath(stop);
  }
  if (!decoded->refused.empty()) {
    return NeedKeyFrame(packet.generation, OfAnotherSize(decoded->refused, size_));
  }
  if (decoded->pixels.empty() && !decoded->damaged) return;  // its picture comes with the next one
  const auto facts = std::find_if(sent_.rbegin(), sent_.rend(), [&](const CodedPicture& sent) {
    return sent.picture_id == decoded->picture_id;
  });
  if (decoded->pixels.empty() || facts == sent_.rend()) return NeedKeyFrame(packet.generation);
  if (!Lay(*facts, decoded->pixels)) {
    return NeedKeyFrame(packet.generation, OfAnotherSize(decoded->pixels.size(), size_));
  }
  if (!decoded->damaged) retry_ = std::chrono::milliseconds(0);
  Deliver(*facts, std::move(decoded->pixels), stop);
  if (decoded->damaged) NeedKeyFrame(packet.generation);
}

bool PhoneSource::Lay(const CodedPicture& packet, cv::Mat& pixels) const {
  const Turn turn{packet.clockwise_deg, false};
  const cv::Size lying =
      turn.swaps_sides() ? cv::Size(pixels.rows, pixels.cols) : cv::Size(pixels.cols, pixels.rows);
  if (lying != size_) return false;
  pixels = Turned({pixels, {}}, turn).grey;
  return true;
}

void PhoneSource::Deliver(const CodedPicture& packet, cv::Mat pixels, const std::stop_token& stop) {
  Frame frame;
  if (pixels.channels() == 3) {
    cv::cvtColor(pixels, frame.grey, cv::COLOR_BGR2GRAY);
    frame.color = std::move(pixels);
  } else {
    frame.grey = std::move(pixels);
  }
  frame.camera = info_.camera;
  {
    const std::lock_guard lock(mutex_);
    if (packet.generation != generation_) return;  // of the phone before
    frame.id = next_id_++;
    const std::optional<Timestamp> time_ns =
        clock_.ToMonotonic(packet.capture_ns, packet.received_ns);
    if (!time_ns) {  // not later than the one before
      ++bad_;
      ++counts_.bad;
      return;
    }
    frame.capture_time_ns = *time_ns;
    frame.received_time_ns = MonotonicNow();
    pictures_.push_back({packet.picture_id, frame.id, packet.received_ns, frame.received_time_ns});
    if (pictures_.size() > kPicturesKept) pictures_.pop_front();
  }
  frames_.Put(std::move(frame), stop);
}

void PhoneSource::NeedKeyFrame(std::uint64_t generation, const std::string& problem) {
  std::shared_ptr<PhoneLink> link;
  bool ask = false, tell = false;
  {
    const std::lock_guard lock(mutex_);
    ++bad_;
    if (generation != generation_) return;  // of the phone before: this one begins anew anyway
    ++counts_.bad;
    needs_key_ = true;
    link = link_;
    const Timestamp now_ns = MonotonicNow();
    ask = now_ns - asked_ns_ > kAskAgain_ns;
    tell = !problem.empty() && now_ns - told_ns_ > kTellAgain_ns;
    if (ask) asked_ns_ = now_ns;
    if (tell) told_ns_ = now_ns;
  }
  if (tell) LogSeldom(absl::StrCat("phone: ", problem));
  if (link && tell) link->Problem(problem);
  if (link && ask) link->WantKeyFrame();
}

}  // namespace saccade
