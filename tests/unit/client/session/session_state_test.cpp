#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/session/acknowledger.hpp"
#include "client/session/latency.hpp"
#include "client/session/pointing.hpp"
#include "client/session/state.hpp"

namespace saccade::session::session_state_test {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;
constexpr Timestamp kMs = 1'000'000;

Annotation Named(const std::string& id, std::int64_t created) {
  Annotation annotation;
  annotation.id = id;
  annotation.created_unix_ns = created;
  return annotation;
}

std::vector<std::string> IdsOf(const std::vector<Annotation>& annotations) {
  std::vector<std::string> ids;
  for (const Annotation& each : annotations) ids.push_back(each.id);
  return ids;
}

TEST(AnnotationBook, ALateAnswerDoesNotBringBackWhatIsGone) {
  AnnotationBook book;
  book.Apply(
      {.full = true, .upserted = {Named("b", 2), Named("a", 1)}, .removed_ids = {}, .anchors = {}});
  EXPECT_THAT(IdsOf(book.List()), ElementsAre("a", "b")) << "oldest first";
  book.Apply({.full = false, .upserted = {}, .removed_ids = {"a"}, .anchors = {}});
  book.Put(Named("a", 1));
  EXPECT_THAT(IdsOf(book.List()), ElementsAre("b"));
}

TEST(AnnotationBook, WhatIsBeingDeletedIsHiddenAndComesBackIfRefused) {
  AnnotationBook book;
  book.Put(Named("a", 1));
  book.Hide("a");
  EXPECT_THAT(book.List(), SizeIs(0));
  EXPECT_EQ(book.Find("a"), nullptr);
  book.Show("a");
  EXPECT_THAT(book.List(), SizeIs(1));
}

TEST(AnnotationBook, AnchorsMoveWithoutTheirStroke) {
  AnnotationBook book;
  Annotation ink = Named("a", 1);
  ink.ink_offset_m = {{0, 0, 0}, {1, 0, 0}};
  book.Put(ink);
  net::AnchorUpdate update{"a", {}};
  update.anchor.point_in_world = {1, 2, 3};
  book.Apply({.full = false, .upserted = {}, .removed_ids = {}, .anchors = {update}});
  EXPECT_EQ(book.Find("a")->anchor.point_in_world, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(book.Find("a")->ink_offset_m.size(), 2u);
}

TEST(State, AMapInPartsIsPutTogetherAndAResetForgetsIt) {
  State state;
  const auto feature = [](FeatureId id) {
    FeatureSnapshot f;
    f.id = id;
    return f;
  };
  state.Apply(net::MapChange{1, 1, true, {feature(1)}, {}}, 0);
  state.Apply(net::MapChange{1, 1, false, {feature(2)}, {}}, 0);
  EXPECT_THAT(state.features, SizeIs(2));
  state.Apply(net::MapChange{1, 1, false, {}, {1}}, 0);
  EXPECT_THAT(state.features, SizeIs(1));
  state.Apply(net::MapChange{2, 2, false, {feature(1)}, {}}, 0);
  EXPECT_EQ(state.features.begin()->first, 1u);
  EXPECT_THAT(state.features, SizeIs(1));
}

TEST(State, ThePathEndsWhereTheMapJumpsAndHasNoLostPoses) {
  State state;
  MapSnapshot pose;
  pose.status = TrackingStatus::kTracking;
  for (int i = 0; i < 10; ++i) {
    pose.world_from_camera.translation.x() = 0.002 * i;  // 5 mm apart are kept
    state.Apply(pose, 0);
  }
  EXPECT_THAT(state.path, SizeIs(4));
  pose.status = TrackingStatus::kLost;
  pose.world_from_camera.translation.x() = 9;
  state.Apply(pose, 0);
  EXPECT_THAT(state.path, SizeIs(4));
  pose.status = TrackingStatus::kTracking;
  pose.map_revision = 1;
  state.Apply(pose, 0);
  EXPECT_THAT(state.path, SizeIs(1));
}

TEST(State, ThePictureIsPausedUntilItIsSaidThatItIsNot) {
  State state;
  state.Apply(net::PicturePause{false, "", 0}, 0);
  EXPECT_FALSE(state.pause);
  state.Apply(net::PicturePause{true, "Ann", 7}, 0);
  ASSERT_TRUE(state.pause);
  state.Begin("again", {});
  EXPECT_EQ(state.pause->by, "Ann") << "over a lost connection as it was last told";
  state.Apply(net::PicturePause{false, "Ann", 9}, 0);
  EXPECT_FALSE(state.pause);
}

net::ChatMessage Said(std::uint64_t number, const std::string& by = "ann") {
  return {number, by, by, "text", "", 0};
}

TEST(ChatBook, KeepsTheLast500InTheirOrderEachOnce) {
  ChatBook book;
  book.Add({Said(2)});
  book.History({Said(1), Said(2)});
  ASSERT_THAT(book.messages(), SizeIs(2));
  EXPECT_EQ(book.messages()[0].number, 1u);
  for (std::uint64_t i = 3; i <= 600; ++i) book.Add({Said(i)});
  ASSERT_THAT(book.messages(), SizeIs(ChatBook::kKept));
  EXPECT_EQ(book.messages().front().number, 101u);
  EXPECT_EQ(book.messages().back().number, 600u);
}

TEST(ChatBook, WhatWasSaidBeforeIsNoNewsNorIsWhatOneSaysOneself) {
  ChatBook book;
  book.History({Said(1), Said(2)});
  EXPECT_EQ(book.Unread("me"), 0u);
  book.Add({Said(3), Said(4, "me")});
  EXPECT_EQ(book.Unread("me"), 1u);
  book.MarkRead();
  EXPECT_EQ(book.Unread("me"), 0u);
}

TEST(ChatBook, AfterTheServerStartedAnewItsConversationIsAnotherOne) {
  ChatBook book;
  book.History({Said(1), Said(2), Said(3)});
  book.History({Said(1, "bob")});
  ASSERT_THAT(book.messages(), SizeIs(1));
  EXPECT_EQ(book.messages()[0].display_name, "bob");
  EXPECT_EQ(book.Unread("me"), 1u);
}

net::PointerNews Stroke(std::size_t first, std::vector<Eigen::Vector3d> points) {
  return {.participant_id = "ann",
          .display_name = "Ann",
          .stroke_id = "s",
          .sketch = true,
          .first = first,
          .points_in_world = std::move(points)};
}

TEST(PointerBook, AStrokeGrowsWhatIsToldAgainCountsOnceAndItsEndEndsIt) {
  PointerBook book;
  book.Apply({Stroke(0, {{0, 0, 1}, {1, 0, 1}})}, "me", 0);
  book.Apply({Stroke(1, {{1, 0, 1}, {2, 0, 1}})}, "me", 0);
  ASSERT_THAT(book.List(), SizeIs(1));
  EXPECT_THAT(book.List()[0].points_in_world, SizeIs(3));
  book.Apply({Stroke(0, {{5, 0, 1}})}, "ann", 0);
  EXPECT_THAT(book.List()[0].points_in_world, SizeIs(3)) << "one's own";
  net::PointerNews laser = Stroke(0, {{0, 0, 1}, {0, 0, 2}});
  laser.sketch = false;
  book.Apply({laser}, "me", 0);
  EXPECT_EQ(book.lasers(), 1u);
  EXPECT_THAT(book.List()[0].points_in_world, ElementsAre(Eigen::Vector3d(0, 0, 2)));
  net::PointerNews end = Stroke(3, {});
  end.released = true;
  book.Apply({end}, "me", 0);
  EXPECT_THAT(book.List(), SizeIs(1));
  EXPECT_FALSE(book.Expire(1000 * kMs));
  EXPECT_TRUE(book.Expire(1600 * kMs));
}

TEST(Pointing, SendsWhatIsNewInOrderOneCallAtATimeAndItsEndLast) {
  Pointing stroke("s", 0xff0000ff);
  EXPECT_FALSE(stroke.Due(1000 * kMs));
  for (int i = 0; i < 70; ++i) stroke.Add(PixelTarget{7, {1.0 * i, 0}});
  const auto first = stroke.Due(1000 * kMs);
  ASSERT_TRUE(first);
  EXPECT_THAT(first->targets, SizeIs(64));
  EXPECT_TRUE(first->sketch);
  stroke.End();
  EXPECT_FALSE(stroke.Due(1100 * kMs)) << "one call at a time";
  stroke.Answered();
  EXPECT_FALSE(stroke.Due(1010 * kMs)) << "60 a second";
  const auto second = stroke.Due(1100 * kMs);
  ASSERT_TRUE(second);
  EXPECT_EQ(std::get<PixelTarget>(second->targets.front()).pixel.x(), 64);
  EXPECT_TRUE(second->released);
  EXPECT_TRUE(stroke.over());
}

TEST(Pointing, AHandThatHoldsStillIsHeardOfAgain) {
  Pointing stroke("s", 0);
  stroke.Add(PixelTarget{7, {3, 4}});
  ASSERT_TRUE(stroke.Due(1000 * kMs));
  stroke.Answered();
  EXPECT_FALSE(stroke.Due(1300 * kMs));
  const auto again = stroke.Due(1401 * kMs);
  ASSERT_TRUE(again);
  EXPECT_THAT(again->targets, SizeIs(1));
  EXPECT_FALSE(again->released);
}

TEST(Acknowledger, SpeaksEveryEighthEventAndHoldsBackWhileTheDecoderIsBehind) {
  Acknowledger acknowledger(8, 0);
  acknowledger.Arrived(7);
  EXPECT_FALSE(acknowledger.Due(10 * kMs, false));
  acknowledger.Arrived(8);
  EXPECT_FALSE(acknowledger.Due(10 * kMs, /*behind=*/true));
  const auto message = acknowledger.Due(20 * kMs, false);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->sequence, 8u);
  acknowledger.Sent(*message, true);
  EXPECT_FALSE(acknowledger.Due(1900 * kMs, false));
  EXPECT_TRUE(acknowledger.Due(2100 * kMs, false)) << "a sign of life";
}

TEST(Acknowledger, AKeyFrameIsAskedForUntilTheAskingHasArrived) {
  Acknowledger acknowledger(8, 0);
  acknowledger.Arrived(3);
  acknowledger.RequestKeyFrame();
  const auto first = acknowledger.Due(kMs, true);
  ASSERT_TRUE(first && first->request_key_frame);
  acknowledger.Sent(*first, /*arrived=*/false);
  const auto second = acknowledger.Due(2 * kMs, true);
  ASSERT_TRUE(second && second->request_key_frame);
  acknowledger.Sent(*second, true);
  EXPECT_FALSE(acknowledger.Due(3 * kMs, true));
}

TEST(ClockOffset, IsTheQuickestPings) {
  ClockOffset clock;
  EXPECT_EQ(clock.offset_ns(), std::nullopt);
  clock.Add({0, 105, 106, 11});  // the worked number of session.proto
  EXPECT_EQ(clock.offset_ns(), 100);
  clock.Add({0, 500, 501, 601});  // slower: does not count
  EXPECT_EQ(clock.offset_ns(), 100);
  EXPECT_EQ(clock.round_trip_ns(), 10);
}

TEST(Latency, StagesSumToTheWholeAndNeedTheClock) {
  net::FrameFacts facts;
  facts.stages = {.captured_ns = 1000 * kMs,
                  .received_ns = 1005 * kMs,
                  .tracked_ns = 1009 * kMs,
                  .encoded_ns = 1013 * kMs};
  facts.arrived_ns = 16 * kMs;
  EXPECT_FALSE(TimesOf(facts, 18 * kMs, 24 * kMs, std::nullopt));
  const auto times = TimesOf(facts, 18 * kMs, 24 * kMs, 1000 * kMs);
  ASSERT_TRUE(times);
  EXPECT_THAT(*times, ElementsAre(5, 4, 4, 3, 2, 6, 24));
  LatencyMeter meter;
  meter.Add(*times);
  EXPECT_EQ(meter.Get(Stage::kTotal)->p50, 24);
}

TEST(State, KeepsTheSceneAsItIsToldAndItsLightApart) {
  State state;
  net::SceneChange first;
  first.revision = 4;
  first.full = true;
  first.upserted.resize(2);
  first.upserted[0].id = "a";
  first.upserted[1].id = "b";
  state.Apply(first, 0);
  const std::uint64_t version = state.scene.version();
  EXPECT_EQ(state.scene.scene().objects.size(), 2u);
  net::SceneChange lit;
  lit.revision = 4;
  lit.light = {0.7, Eigen::Vector3d(0, -0.4, 0), 0.9};
  state.Apply(lit, 0);
  EXPECT_EQ(state.scene.light().level, 0.7);
  EXPECT_EQ(state.scene.version(), version);  // nothing is uploaded anew
  net::SceneChange moved = lit;
  moved.revision = 5;
  moved.upserted.resize(1);
  moved.upserted[0].id = "b";
  moved.upserted[0].parent_from_object.translation.x() = 2;
  moved.removed_ids = {"a"};
  state.Apply(moved, 0);
  ASSERT_EQ(state.scene.scene().objects.size(), 1u);
  EXPECT_EQ(state.scene.scene().objects[0].parent_from_object.translation.x(), 2);
  EXPECT_GT(state.scene.version(), version);
  const auto model = std::make_shared<SceneModel>();
  model->id = "m";
  state.scene.Add(model);
  state.scene.Add(model);
  EXPECT_EQ(state.scene.scene().models.size(), 1u);
  first.upserted.clear();
  state.Apply(first, 0);
  EXPECT_TRUE(state.scene.scene().objects.empty());
  EXPECT_EQ(state.scene.scene().models.size(), 1u);  // models are what their ids say
}

}  // namespace
}  // namespace saccade::session::session_state_test
