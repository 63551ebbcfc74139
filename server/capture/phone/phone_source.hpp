#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/capture/phone/packet_decoder.hpp"
#include "server/capture/phone/phone_clock.hpp"
#include "server/capture/source.hpp"
#include "server/capture/video/frame_queue.hpp"

namespace saccade {

/// The phone's DeviceMotion. Kept and mapped to the monotonic clock; the tracker does not use it.
struct MotionSample {
  Timestamp time_ns = 0;                                        // monotonic
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();  // with gravity
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
};

/// What became of one picture.
struct PhonePicture {
  std::uint64_t picture_id = 0;
  FrameId frame_id = 0;
  Timestamp received_ns = 0, decoded_ns = 0;  // MonotonicNow()
};

/// Of the link that is there.
struct PhoneCounts {
  std::uint64_t dropped = 0;  // coded, but newer ones were there, or what they refer to was lost
  std::uint64_t bad = 0;      // could not be decoded, or of another size
  std::uint64_t motion = 0;   // samples
};

/// The phone at the other end. Called on the source's thread; must not block.
class PhoneLink {
 public:
  virtual ~PhoneLink() = default;
  virtual void WantKeyFrame() = 0;
  /// The pictures are of no use, in words with the remedy.
  virtual void Problem(const std::string& text) = 0;
};

/// `phone:[?size=WxH&fps=N]`: pictures that a phone's browser codes and sends (server/rpc's
/// WearerEntrance brings them here). Next() waits while there is no phone, and goes on when one
/// comes; the map stays. Whatever comes, the newest picture wins: at most `kMostWaiting` coded ones
/// wait, and one decoded. After a damaged or a lost one the phone is asked for a key frame, and
/// pictures in between are left out.
///
/// Size and lens are the sensor's, fixed from the start: a phone that is turned says so with each
/// picture (CodedPicture::clockwise_deg), which is laid back here, so that a turn of the phone is
/// to the tracker what it is, a turn of the camera. Pictures of another size are refused in words.
class PhoneSource final : public FrameSource {
 public:
  static constexpr std::size_t kMostWaiting = 8;

  /// Errors as OpenV4l2, of the options.
  static absl::StatusOr<std::unique_ptr<PhoneSource>> Open(absl::string_view rest,
                                                           const SourceOptions& options);
  ~PhoneSource() override { Stop(); }

  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override;
  std::uint64_t bad_frames() const override { return bad_; }
  std::uint64_t dropped_frames() const override { return dropped_ + frames_.dropped(); }
  void Stop() override;

  // Any thread, none blocks.
  /// `link` has the camera from here on; the first picture has to be a key frame.
  void Begin(std::shared_ptr<PhoneLink> link);
  /// If it still has it.
  void End(const PhoneLink* link);
  void Offer(const PhoneLink* link, CodedPicture picture);
  /// As PhoneClock::Add.
  void AddPing(const PhoneLink* link, Timestamp server_sent_ns, Timestamp phone_arrived_ns,
               Timestamp phone_sent_ns, Timestamp server_arrived_ns);
  /// `phone_ns`: the phone's clock.
  void AddMotion(const PhoneLink* link, Timestamp phone_ns, MotionSample sample);
  /// One of the last 64 frames, of the link that is there.
  std::optional<PhonePicture> Find(FrameId frame) const;
  PhoneCounts counts() const;
  std::deque<MotionSample> motion() const;  // the last two seconds
  pid_t decoder_pid() const { return decoder_.decoder_pid(); }
  std::uint64_t decoder_restarts() const { return decoder_.restarts(); }

 private:
  PhoneSource(SourceInfo info, cv::Size size);

  // The decoding thread.
  void Run(const std::stop_token& stop);
  std::optional<CodedPicture> Take(const std::stop_token& stop);
  /// A decoder died: the next one is not started at once, and later each time.
  void WaitAfterDeath(const std::stop_token& stop);
  /// Once in a while: a phone is not to fill the log.
  void LogSeldom(const std::string& text);
  void Decode(const CodedPicture& packet, const std::stop_token& stop);
  /// Upright as the sensor; false: of another size.
  bool Lay(const CodedPicture& packet, cv::Mat& pixels) const;
  void Deliver(const CodedPicture& packet, cv::Mat pixels, const std::stop_token& stop);
  /// Nothing is decoded before the next key frame, which is asked for; unless another phone has
  /// begun since `generation`.
  void NeedKeyFrame(std::uint64_t generation, const std::string& problem = "");

  const SourceInfo info_;
  const cv::Size size_;
  std::atomic<std::uint64_t> bad_ = 0, dropped_ = 0;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::shared_ptr<PhoneLink> link_;  // guarded by mutex_, as what follows; null: no phone
  std::uint64_t generation_ = 0;     // Begin()s so far: what is of an earlier one is left out
  std::deque<CodedPicture> waiting_;
  bool needs_key_ = true;
  Timestamp asked_ns_ = 0, told_ns_ = 0;
  PhoneClock clock_;
  PhoneCounts counts_;
  std::deque<PhonePicture> pictures_;
  std::deque<MotionSample> motion_;
  FrameId next_id_ = 0;

  PacketDecoder decoder_;  // the decoding thread's
  bool anew_ = true;
  std::deque<CodedPicture> sent_;       // to the decoder, of one generation, without their bytes
  std::chrono::milliseconds retry_{0};  // waited after the last death; 0: a good picture came since
  Timestamp logged_ns_ = 0;
  FrameQueue frames_{Pace::kNewest, 1};
  std::jthread reader_;  // last: joins before the rest goes
};

}  // namespace saccade
