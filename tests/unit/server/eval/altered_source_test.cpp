#include "server/eval/altered_source.hpp"

#include <gtest/gtest.h>

namespace saccade::altered_source_test {
namespace {

/// 20 frames at 10 Hz; each picture is as bright as its number.
class CountingSource final : public FrameSource {
 public:
  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override {
    if (next_ == 20) return std::nullopt;
    Frame frame;
    frame.id = next_++;
    frame.capture_time_ns = static_cast<Timestamp>(frame.id) * 100'000'000;
    frame.grey = cv::Mat(2, 2, CV_8UC1, cv::Scalar(static_cast<double>(frame.id)));
    return frame;
  }
  std::uint64_t bad_frames() const override { return 7; }

 private:
  SourceInfo info_;
  FrameId next_ = 0;
};

std::vector<Frame> All(const Alterations& alterations) {
  const auto source = Altered(std::make_unique<CountingSource>(), alterations);
  EXPECT_EQ(source->bad_frames(), 7);
  std::vector<Frame> frames;
  for (auto next = source->Next(); next.ok() && *next; next = source->Next()) {
    frames.push_back(**next);
  }
  return frames;
}

std::vector<FrameId> Ids(const Alterations& alterations) {
  std::vector<FrameId> ids;
  for (const Frame& frame : All(alterations)) ids.push_back(frame.id);
  return ids;
}

TEST(AlteredSource, DroppedFramesLeaveAGapInIdsAndStamps) {
  const std::vector<Frame> frames = All({.drop = {{3, 17}, {18, std::nullopt}}});
  ASSERT_EQ(frames.size(), 4);
  EXPECT_EQ(frames[3].id, 17);
  EXPECT_EQ(frames[3].capture_time_ns - frames[2].capture_time_ns, 1'500'000'000);
}

TEST(AlteredSource, EveryNthCountsWhatWasNotDropped) {
  EXPECT_EQ(Ids({.every = 6}), (std::vector<FrameId>{0, 6, 12, 18}));
  EXPECT_EQ(Ids({.drop = {{1, 4}}, .every = 6}), (std::vector<FrameId>{0, 9, 15}));
}

TEST(AlteredSource, AFrozenPictureComesWithTimesThatGoOn) {
  const std::vector<Frame> frames = All({.freeze = Freeze{5, 400'000'000}});
  ASSERT_EQ(frames.size(), 20);
  for (const Frame& frame : frames) {
    EXPECT_EQ(frame.capture_time_ns, static_cast<Timestamp>(frame.id) * 100'000'000);
    const bool frozen = frame.id >= 5 && frame.id <= 9;
    EXPECT_EQ(frame.grey.at<std::uint8_t>(0, 0), frozen ? 5 : frame.id);
  }
}

TEST(ParseFreeze, IsAFrameAndSeconds) {
  EXPECT_EQ(ParseFreeze("300:2")->frame, 300);
  EXPECT_EQ(ParseFreeze("300:2.5")->duration_ns, 2'500'000'000);
  for (const char* text : {"", "300", "300:", ":2", "a:2", "3:0", "3:-1", "3:nan", "3:4000"}) {
    EXPECT_FALSE(ParseFreeze(text).ok()) << text;
  }
}

}  // namespace
}  // namespace saccade::altered_source_test
