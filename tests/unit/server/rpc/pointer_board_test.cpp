#include "server/rpc/pointer_board.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/rpc/pointer_reader.hpp"
#include "shared/scene/limits.hpp"

namespace saccade::pointer_board_test {
namespace {

using std::chrono::milliseconds;

const char kStroke[] = "00000000-0000-4000-8000-000000000001";
const char kOther[] = "00000000-0000-4000-8000-000000000002";

Session Ann() {
  Session session;
  session.participant_id = "ann";
  session.person_id = "person ann";
  session.display_name = "Ann";
  session.access_id = "token";
  return session;
}

PointerWord Word(PointerKind kind, const char* stroke, std::size_t points, double x = 0) {
  PointerWord word;
  word.kind = kind;
  word.stroke_id = stroke;
  for (std::size_t i = 0; i < points; ++i)
    word.points.emplace_back(x + static_cast<double>(i), 0, 1);
  return word;
}

class Board : public ::testing::Test {
 protected:
  std::shared_ptr<const PointerList> list() {
    const std::lock_guard lock(mutex_);
    return list_;
  }
  std::mutex mutex_;
  std::shared_ptr<const PointerList> list_ = std::make_shared<const PointerList>();
  PointerBoard board_{[this](std::shared_ptr<const PointerList> list) {
    const std::lock_guard lock(mutex_);
    list_ = std::move(list);
  }};
};

TEST_F(Board, ALaserHasItsNewestPointAndAStrokeAllOfThem) {
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kStroke, 3)).ok());
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kOther, 3)).ok());
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kOther, 2, 10)).ok());
  ASSERT_EQ(list()->size(), 2u);
  EXPECT_EQ((*list())[0].points->size(), 1u);
  EXPECT_EQ((*list())[0].points->back().x(), 2.0);
  EXPECT_EQ((*list())[1].points->size(), 5u);
  EXPECT_EQ((*list())[1].points->back().x(), 11.0);
}

TEST_F(Board, AStrokeHasAnEndAndSaysSo) {
  for (std::size_t i = 0; i < kMaxInkPoints / 50; ++i) {
    ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 50)).ok());
  }
  const absl::Status status = board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 1));
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), ::testing::StartsWith("points: "));
  EXPECT_EQ(list()->front().points->size(), kMaxInkPoints);
}

TEST_F(Board, AnotherStrokeReleasesTheOneBeforeAndAReleasedOneTakesNoMore) {
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 1)).ok());
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kOther, 1)).ok());
  EXPECT_TRUE((*list())[0].released);
  EXPECT_FALSE((*list())[1].released);
  EXPECT_EQ(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 1)).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(Board, TheSilentAreReleasedAfterASecondByThemselvesAndForgottenAfterAnother) {
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kStroke, 1)).ok());
  std::this_thread::sleep_for(milliseconds(700));
  EXPECT_FALSE(list()->front().released);
  std::this_thread::sleep_for(milliseconds(500));
  ASSERT_EQ(list()->size(), 1u);
  EXPECT_TRUE(list()->front().released);
  std::this_thread::sleep_for(milliseconds(1200));
  EXPECT_TRUE(list()->empty());
}

TEST_F(Board, WhoWasOnlySilentGoesOnAndReadersGetAllOfItAgain) {
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 2)).ok());
  PointerReader reader;
  v1::PointerEvent before, ended, again;
  ASSERT_TRUE(reader.Next(*list(), before));
  board_.Expire(MonotonicNow() + PointerBoard::kSilence);
  ASSERT_TRUE(reader.Next(*list(), ended));
  EXPECT_TRUE(ended.pointers(0).released());
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 1, 2)).ok());
  ASSERT_TRUE(reader.Next(*list(), again));
  EXPECT_FALSE(again.pointers(0).released());
  EXPECT_EQ(again.pointers(0).first(), 0u);
  EXPECT_EQ(again.pointers(0).points_in_world_m_size(), 3);
}

TEST_F(Board, EndsWithItsSessionAndWithItsToken) {
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kStroke, 1)).ok());
  board_.EndParticipant("bob");
  EXPECT_FALSE(list()->front().released);
  board_.EndParticipant("ann");
  EXPECT_TRUE(list()->front().released);
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kOther, 1)).ok());
  board_.EndAccess({"token"});
  EXPECT_TRUE(list()->back().released);
}

TEST_F(Board, IsBounded) {
  for (std::size_t i = 0; i < PointerBoard::kMost; ++i) {
    Session one = Ann();
    one.participant_id = std::to_string(i);
    ASSERT_TRUE(board_.Say(one, Word(PointerKind::kLaser, kStroke, 1)).ok());
  }
  EXPECT_EQ(board_.Say(Ann(), Word(PointerKind::kLaser, kStroke, 1)).code(),
            absl::StatusCode::kResourceExhausted);
}

TEST_F(Board, AReaderMissesPointsOfLasersNeverOfStrokes) {
  PointerReader reader;
  std::size_t strokes = 0, events = 0;
  for (int i = 0; i < 6; ++i) {
    ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 64, 64.0 * i)).ok());
    ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kOther, 1, i)).ok());
    if (i % 3 != 2) continue;  // it is slow
    v1::PointerEvent event;
    ASSERT_TRUE(reader.Next(*list(), event));
    ++events;
    for (const v1::Pointer& pointer : event.pointers()) {
      if (pointer.kind() == v1::POINTER_KIND_LASER) {
        ASSERT_EQ(pointer.points_in_world_m_size(), 1);
        EXPECT_EQ(pointer.points_in_world_m(0).x(), i);
        continue;
      }
      EXPECT_EQ(pointer.first(), strokes);
      for (const v1::Vector3& point : pointer.points_in_world_m()) {
        EXPECT_EQ(point.x(), static_cast<double>(strokes++));
      }
    }
  }
  EXPECT_EQ(events, 2u);
  EXPECT_EQ(strokes, 6u * 64u);
  v1::PointerEvent nothing;
  EXPECT_FALSE(reader.Next(*list(), nothing)) << "it has been told";
}

TEST_F(Board, ALateReaderGetsWhatLivesInPartsAndOfWhatEndedNothing) {
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kSketch, kStroke, 60)).ok());
  }
  PointerReader known, late;
  std::size_t points = 0, parts = 0;
  do {
    v1::PointerEvent event;
    ASSERT_TRUE(known.Next(*list(), event));
    ASSERT_EQ(event.pointers_size(), 1);
    points += static_cast<std::size_t>(event.pointers(0).points_in_world_m_size());
    EXPECT_LE(event.ByteSizeLong(), 64'000u);
    ++parts;
  } while (!known.complete());
  EXPECT_EQ(points, 1800u);
  EXPECT_EQ(parts, 2u);
  PointerWord end = Word(PointerKind::kSketch, kStroke, 0);
  end.released = true;
  ASSERT_TRUE(board_.Say(Ann(), std::move(end)).ok());
  v1::PointerEvent event, nothing;
  ASSERT_TRUE(known.Next(*list(), event));
  EXPECT_TRUE(event.pointers(0).released());
  EXPECT_FALSE(late.Next(*list(), nothing));
}

TEST_F(Board, WhoWasTooSlowToHearOfAnEndHearsOfItStill) {
  PointerReader reader;
  v1::PointerEvent first, second, third;
  ASSERT_TRUE(board_.Say(Ann(), Word(PointerKind::kLaser, kStroke, 1)).ok());
  ASSERT_TRUE(reader.Next(*list(), first));
  ASSERT_TRUE(reader.Next({}, second));
  ASSERT_EQ(second.pointers_size(), 1);
  EXPECT_TRUE(second.pointers(0).released());
  EXPECT_EQ(second.pointers(0).stroke_id(), kStroke);
  EXPECT_FALSE(reader.Next({}, third));
}

}  // namespace
}  // namespace saccade::pointer_board_test
