#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "client/session/picture_sink.hpp"

namespace saccade::decode {

/// A picture with the facts of its own frame: the pose it is drawn over with is never another's.
struct Picture {
  std::shared_ptr<const net::FrameFacts> facts;
  cv::Mat rgba;              // CV_8UC4
  Timestamp decoded_ns = 0;  // this machine's clock
};

/// Decodes on a thread of its own and keeps the newest picture. A picture that cannot be decoded
/// (a part of the stream was lost) asks for a key frame and is not shown; nor are those that refer
/// to it.
class Player : public session::PictureSink {
 public:
  /// `wake` is called on the decoder's thread when there is a new picture; outlives this.
  explicit Player(std::function<void()> wake);
  ~Player() override;

  // Any thread.
  void Push(net::CodedPicture picture) override;
  void Reset() override;
  bool Behind() const override;
  bool TakeKeyFrameRequest() override;

  /// The newest since the last call; nothing: none.
  std::optional<Picture> Take();
  /// Why there is no video, in words; empty: there can be.
  std::string problem() const;

 private:
  void Run(std::stop_token stop);

  const std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<net::CodedPicture> waiting_;
  std::optional<Picture> newest_;
  bool key_frame_needed_ = true;  // what comes before one cannot be decoded
  bool ask_for_key_frame_ = false;
  std::uint64_t subscription_ = 0;  // rises with Reset()
  std::string problem_;
  std::jthread thread_;  // last: it uses what stands above
};

}  // namespace saccade::decode
