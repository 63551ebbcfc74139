#include "client/tools/marks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/tools/words.hpp"

namespace saccade::tools {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Annotation Mark(AnchorState state, double error_m, std::optional<double> error_px) {
  Annotation mark;
  mark.anchor.state = state;
  mark.anchor.error_m = error_m;
  mark.anchor.error_px = error_px;
  mark.anchor.point_in_world = {0, 0, 1};
  return mark;
}
const Scale kMetric{true, Eigen::Vector3d::Zero()};

TEST(Trust, IsTheServersAndOfWhatItHasNotJudgedByTheLimits) {
  EXPECT_FALSE(DoNotTrust(Mark(AnchorState::kTracking, 9, 90).anchor, kMetric));
  EXPECT_TRUE(DoNotTrust(Mark(AnchorState::kPaused, 0, 0).anchor, kMetric));
  EXPECT_FALSE(DoNotTrust(Mark(AnchorState::kProvisional, 0.049, 9.0).anchor, kMetric));
  EXPECT_TRUE(DoNotTrust(Mark(AnchorState::kProvisional, 0.051, 1.0).anchor, kMetric));
  EXPECT_TRUE(DoNotTrust(Mark(AnchorState::kProvisional, 0.001, 10.1).anchor, kMetric));
  EXPECT_FALSE(DoNotTrust(Mark(AnchorState::kProvisional, 0.5, 1.0).anchor, Scale{}))
      << "no metres";
}

TEST(AnchorWords, SayErrorOrWhyNot) {
  EXPECT_EQ(WordsOf(Mark(AnchorState::kTracking, 0.003, 0.8), kMetric).text, "0.8 px · 3.0 mm");
  EXPECT_EQ(WordsOf(Mark(AnchorState::kTracking, 0.003, std::nullopt), Scale{}).text,
            "out of view · scale unknown");
  Annotation paused = Mark(AnchorState::kPaused, 0, 0);
  paused.anchor.reason = "tracking is lost";
  EXPECT_EQ(WordsOf(paused, kMetric).text, "do not trust: tracking is lost");
  EXPECT_TRUE(WordsOf(paused, kMetric).warn);
}

TEST(MarkFilter, FindsByEveryWordOfTextShapeAndAuthorWhateverTheCase) {
  Annotation mark;
  mark.text = "Oil filter";
  mark.author = "Ann";
  mark.shape = AnnotationShape::kNote;
  EXPECT_TRUE(Passes(mark, {"FILTER oil", false}, "Bob"));
  EXPECT_TRUE(Passes(mark, {"note ann", false}, "Bob"));
  EXPECT_FALSE(Passes(mark, {"oil cube", false}, "Bob"));
  EXPECT_FALSE(Passes(mark, {"", true}, "Bob"));
  EXPECT_TRUE(Passes(mark, {"", true}, "Ann"));
}

TEST(InkLine, LeavesOutWhatIsNearAndSmoothsWhatIsLeft) {
  InkLine ink;
  ink.Begin(3, {0, 0});
  ink.Add({1, 0});  // nearer than 2 px
  for (int i = 1; i <= 10; ++i) ink.Add({4.0 * i, i % 2 == 0 ? 0.0 : 2.0});
  EXPECT_EQ(ink.frame_id(), 3u);
  const std::vector<Eigen::Vector2d> line = ink.Finish();
  ASSERT_THAT(line, SizeIs(11));
  EXPECT_EQ(line.front(), Eigen::Vector2d(0, 0));
  EXPECT_NEAR(line[5].y(), 1, 1e-9) << "a zigzag of 2 px is smoothed to its middle";
  EXPECT_FALSE(ink.drawing());
  ink.Begin(4, {5, 5});
  EXPECT_THAT(ink.Finish(), IsEmpty()) << "a point is no stroke";
}

TEST(StatusWords, SayWhatIsWrongAndWhatToDo) {
  session::State state;
  constexpr Timestamp kSecond = 1'000'000'000;
  EXPECT_EQ(StatusOf(state, 0).text, "connecting");
  state.link = {session::Link::Kind::kReconnecting, "no answer", 10 * kSecond};
  EXPECT_EQ(StatusOf(state, 14 * kSecond).text, "reconnecting, 4 s");
  MapSnapshot pose;
  pose.status = TrackingStatus::kLost;
  state.Apply(pose, 20 * kSecond);
  EXPECT_EQ(StatusOf(state, 20 * kSecond).text, "lost");
  EXPECT_EQ(StatusOf(state, 20 * kSecond).advice, "show a place seen before");
  EXPECT_EQ(StatusOf(state, 25 * kSecond).text, "no picture for 5 s");
  pose.status = TrackingStatus::kTracking;
  pose.quality = TrackingQuality::kGood;
  state.Apply(pose, 26 * kSecond);
  EXPECT_EQ(StatusOf(state, 26 * kSecond).text, "tracking good");
  EXPECT_FALSE(StatusOf(state, 26 * kSecond).warn);
}

}  // namespace
}  // namespace saccade::tools
