#include "client/tools/marks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/tools/selection.hpp"
#include "client/tools/words.hpp"
#include "client/tools/written.hpp"

namespace saccade::tools::marks_test {
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

TEST(Selection, GrowsAndShrinksByToggling) {
  Selection selection;
  selection.Only("a");
  selection.Toggle("b");
  EXPECT_EQ(selection.last(), "b");
  selection.Toggle("a");
  EXPECT_FALSE(selection.Has("a"));
  EXPECT_THAT(selection.ids(), SizeIs(1));
  selection.Only("c");
  EXPECT_THAT(selection.ids(), SizeIs(1));
  selection.Clear();
  EXPECT_EQ(selection.last(), "");
}

TEST(ReadList, TakesALineForEachThingAndSaysWhatCannotBeKept) {
  const auto list = ReadList(" Oil\tchange ", "drain\n\n  fill \r\n");
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->title, "Oil change");
  EXPECT_THAT(list->items, ::testing::ElementsAre("drain", "fill"));
  EXPECT_EQ(ReadList("x", " \n").status().message(), "Write at least one line.");
  EXPECT_EQ(ReadList("", "a\n" + std::string(101, 'b')).status().message(),
            "Line 2 has 101 bytes, and at most 100 are kept: shorten it.");
  std::string many;
  for (int i = 0; i < 31; ++i) many += "a\n";
  EXPECT_EQ(ReadList("", many).status().message(), "31 lines, and at most 30 are kept.");
  EXPECT_EQ(ReadList(std::string(502, 't'), "a").status().message(),
            "The title is 2 bytes too long: shorten it.");
}

TEST(TitleOf, IsItsTextElseItsShape) {
  Annotation mark;
  EXPECT_EQ(TitleOf(mark), "the cube");
  mark.shape = AnnotationShape::kCheckList;
  mark.text = "Oil\nsecond";
  EXPECT_EQ(TitleOf(mark), "check list “Oil”");
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
  state.pause = net::PicturePause{true, "Ann", 0};
  EXPECT_EQ(StatusOf(state, 25 * kSecond).text, "picture paused") << "and it is not missed";
  EXPECT_EQ(PauseWords(*state.pause).substr(0, 24), "Ann paused the picture a");
  state.pause->by.clear();
  EXPECT_EQ(PauseWords(*state.pause).substr(0, 10), "The wearer");
  state.pause.reset();
  pose.status = TrackingStatus::kTracking;
  pose.quality = TrackingQuality::kGood;
  state.Apply(pose, 26 * kSecond);
  EXPECT_EQ(StatusOf(state, 26 * kSecond).text, "tracking good");
  EXPECT_FALSE(StatusOf(state, 26 * kSecond).warn);
}

}  // namespace
}  // namespace saccade::tools::marks_test
