// One wearable, stepped by hand.
#include "server/wearable/wearable.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::wearable_test {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

class WearableTest : public ::testing::Test {
 protected:
  void SetUp() override {
    SimOptions options;
    options.duration_s = 2.0;
    auto source = SimSource::Open(options);
    ASSERT_TRUE(source.ok()) << source.status();
    source_ = *std::move(source);
    auto tracker = Tracker::Create(source_->info(), TrackerOptions());
    ASSERT_TRUE(tracker.ok()) << tracker.status();
    auto wearable = Wearable::Create(source_->info(), *std::move(tracker), AnchorOptions());
    ASSERT_TRUE(wearable.ok()) << wearable.status();
    wearable_ = *std::move(wearable);
  }
  void Step(int frames) {
    for (int k = 0; k < frames; ++k) {
      auto frame = source_->Next();
      ASSERT_TRUE(frame.ok() && *frame);
      wearable_->Step(**std::move(frame));
    }
  }
  absl::StatusOr<Annotation> Click(FrameId frame, const Eigen::Vector2d& pixel) {
    AnnotationDraft draft;
    draft.request_id = "00000000-0000-4000-8000-000000000001";
    draft.author = "expert";
    draft.target = PixelTarget{frame, pixel};
    absl::StatusOr<Annotation> answer = absl::UnknownError("not answered");
    wearable_->Execute(CreateAnnotation{
        "expert", draft,
        [&answer](absl::StatusOr<Annotation> given) { answer = std::move(given); }});
    return answer;
  }

  std::unique_ptr<SimSource> source_;
  std::unique_ptr<Wearable> wearable_;
};

TEST_F(WearableTest, BeforeTheFirstFrameThereIsNothingAndNobodyMinds) {
  EXPECT_EQ(wearable_->newest(), nullptr);
  EXPECT_THAT(*wearable_->annotations(), IsEmpty());
  wearable_->Settle();
  EXPECT_FALSE(Click(0, {320, 240}).ok());
  std::uint64_t generation = 99;
  wearable_->Execute(ResetMap{[&](absl::StatusOr<std::uint64_t> given) { generation = *given; }});
  EXPECT_EQ(generation, 0u);
}

TEST_F(WearableTest, AClickInAPastFrameIsAnsweredAtOnceAndFollowed) {
  Step(30);
  const auto clicked = Click(20, {320, 240});
  ASSERT_TRUE(clicked.ok()) << clicked.status();
  ASSERT_THAT(*wearable_->annotations(), SizeIs(1));
  Step(10);
  const Annotation& now = wearable_->annotations()->front();
  EXPECT_EQ(now.id, clicked->id);
  EXPECT_TRUE(now.anchor.place_known);
  const GazeView view = wearable_->View(MountAngles());
  EXPECT_EQ(view.map, wearable_->newest()->snapshot);
  EXPECT_EQ(view.annotations, wearable_->annotations());
  EXPECT_TRUE(view.down_in_world.has_value()) << "the chessboard hangs upright";
}

TEST_F(WearableTest, TheCostOfAFrameIsTheTrackersAlone) {
  Step(5);
  const FrameCost& cost = wearable_->newest()->cost;
  EXPECT_GT(cost.wall_ms, 0.0);
  EXPECT_GE(cost.wall_ms + 0.5, wearable_->newest()->snapshot->stage_ms.total_ms);
}

TEST_F(WearableTest, ResetShowsInTheNewestStep) {
  Step(10);
  const std::uint64_t before = wearable_->newest()->snapshot->map_generation;
  std::uint64_t told = 0;
  wearable_->Execute(ResetMap{[&](absl::StatusOr<std::uint64_t> given) { told = *given; }});
  EXPECT_EQ(told, before + 1);
  EXPECT_EQ(wearable_->newest()->snapshot->map_generation, told);
}

TEST_F(WearableTest, ReadersStillGetAnAnswerAfterTheEnd) {
  Step(30);
  ASSERT_TRUE(Click(25, {320, 240}).ok());
  wearable_->Close();
  EXPECT_THAT(*wearable_->annotations(), IsEmpty());
  EXPECT_TRUE(wearable_->Flush(std::chrono::milliseconds(10)).ok());
  EXPECT_TRUE(wearable_->ring().Find(25).ok());
}

}  // namespace
}  // namespace saccade::wearable_test
