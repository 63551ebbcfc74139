#include "client/decode/player.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "server/encode/video_encoder.hpp"

namespace saccade::decode::player_test {
namespace {

/// The pictures of a moving bar, coded: picture i has its bar at column 4 i, and frame id i.
class CodedBars {
 public:
  CodedBars() : encoder_(*VideoEncoder::Create({.width = 160, .height = 120})) {}
  net::CodedPicture Next() {
    cv::Mat picture(120, 160, CV_8UC3, cv::Scalar(40, 40, 40));
    cv::rectangle(picture, cv::Rect(4 * id_, 0, 16, 120), cv::Scalar(250, 250, 250), cv::FILLED);
    const auto coded = encoder_->Encode(picture, force_);
    force_ = false;
    auto facts = std::make_shared<net::FrameFacts>();
    facts->frame_id = static_cast<FrameId>(id_++);
    return {facts, coded->key_frame, *coded->data};
  }
  void Force() { force_ = true; }

 private:
  std::unique_ptr<VideoEncoder> encoder_;
  int id_ = 0;
  bool force_ = true;
};

/// Middle of the bright columns.
double BarIn(const cv::Mat& rgba) {
  double sum = 0, weight = 0;
  for (int x = 0; x < rgba.cols; ++x) {
    const double bright = rgba.at<cv::Vec4b>(60, x)[0] > 140 ? 1 : 0;
    sum += bright * x;
    weight += bright;
  }
  return sum / weight;
}

template <typename Condition>
bool WaitFor(Condition condition) {
  for (int i = 0; i < 500; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(Player, EachPictureComesWithTheFactsOfItsOwnFrame) {
  std::atomic<int> woken = 0;
  Player player([&woken] { ++woken; });
  CodedBars bars;
  for (int i = 0; i < 12; ++i) {
    player.Push(bars.Next());
    std::optional<Picture> picture;
    ASSERT_TRUE(WaitFor([&] { return (picture = player.Take()).has_value(); })) << i;
    EXPECT_EQ(picture->facts->frame_id, static_cast<FrameId>(i));
    EXPECT_NEAR(BarIn(picture->rgba), 4.0 * i + 7.5, 2.0);
    EXPECT_EQ(picture->rgba.size(), cv::Size(160, 120));
  }
  EXPECT_GE(woken.load(), 12);
}

TEST(Player, AfterALossItAsksForAKeyFrameAndShowsNothingUntilThen) {
  Player player([] {});
  CodedBars bars;
  player.Push(bars.Next());
  ASSERT_TRUE(WaitFor([&] { return player.Take().has_value(); }));
  net::CodedPicture broken = bars.Next();
  broken.data.resize(6);  // start code and the beginning of a header
  player.Push(broken);
  ASSERT_TRUE(WaitFor([&] { return player.TakeKeyFrameRequest(); }));
  EXPECT_FALSE(player.TakeKeyFrameRequest()) << "once";
  for (int i = 0; i < 3; ++i) player.Push(bars.Next());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(player.Take()) << "what refers to a lost picture is not shown";
  bars.Force();
  const net::CodedPicture key = bars.Next();
  player.Push(key);
  std::optional<Picture> picture;
  ASSERT_TRUE(WaitFor([&] { return (picture = player.Take()).has_value(); }));
  EXPECT_EQ(picture->facts->frame_id, key.facts->frame_id);
}

TEST(Player, ANewSubscriptionForgetsTheOldOnesPictures) {
  Player player([] {});
  CodedBars bars;
  player.Push(bars.Next());
  player.Reset();
  player.Push(bars.Next());  // no key frame
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(player.Take());
  EXPECT_FALSE(player.Behind());
}

}  // namespace
}  // namespace saccade::decode::player_test
