#include "client/decode/player.hpp"

#include <utility>

#include "client/decode/video_decoder.hpp"

namespace saccade::decode {
namespace {

constexpr std::size_t kBehind = 4;  // pictures waiting

}  // namespace

Player::Player(std::function<void()> wake) : wake_(std::move(wake)) {
  thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}
Player::~Player() = default;

void Player::Push(net::CodedPicture picture) {
  const std::lock_guard lock(mutex_);
  if (key_frame_needed_ && !picture.key_frame) return;
  key_frame_needed_ = false;
  waiting_.push_back(std::move(picture));
  changed_.notify_all();
}

void Player::Reset() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  newest_.reset();
  key_frame_needed_ = true;
  ask_for_key_frame_ = false;
  ++subscription_;
}

bool Player::Behind() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size() >= kBehind;
}

bool Player::TakeKeyFrameRequest() {
  const std::lock_guard lock(mutex_);
  return std::exchange(ask_for_key_frame_, false);
}

std::optional<Picture> Player::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

std::string Player::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

void Player::Run(std::stop_token stop) {
  auto decoder = VideoDecoder::Create();
  if (!decoder.ok()) {
    const std::lock_guard lock(mutex_);
    problem_ = std::string(decoder.status().message());
    return;
  }
  for (;;) {
    net::CodedPicture coded;
    std::uint64_t subscription = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return !waiting_.empty(); });
      if (stop.stop_requested()) return;
      coded = std::move(waiting_.front());
      waiting_.pop_front();
      subscription = subscription_;
    }
    absl::StatusOr<cv::Mat> picture = (*decoder)->Decode(coded.data);
    {
      const std::lock_guard lock(mutex_);
      if (subscription != subscription_) continue;  // of a stream that is over
      if (!picture.ok()) {
        waiting_.clear();
        key_frame_needed_ = ask_for_key_frame_ = true;
        continue;
      }
      newest_ = Picture{std::move(coded.facts), *std::move(picture), MonotonicNow()};
    }
    wake_();
  }
}

}  // namespace saccade::decode
