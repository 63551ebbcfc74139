#include "server/team/merge/map_joiner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "server/eval/team/foreign_rooms.hpp"

namespace saccade::map_joiner_test {
namespace {

struct Walkers {
  std::vector<TeamKeyframe> own, other;
  Similarity3 own_from_other;
};

/// Two in one room whose maps began elsewhere; not metric: in units of their own.
Walkers InOneRoom(std::uint64_t seed, bool metric) {
  std::mt19937_64 random(seed);
  const PointRoom room = MakeRooms(RoomsShare::kNothing, random)[0];
  PointWalkOptions first, second;
  first.metric = second.metric = metric;
  second.map_from_room = {metric ? 1.0 : 0.6, ExpQuaternion({0.1, 2.0, -0.2}), {1.0, -0.5, 2.0}};
  second.yaw_from = 1.0;
  Walkers walkers{WalkThrough(room, first, random), WalkThrough(room, second, random), {}};
  walkers.own_from_other = first.map_from_room * second.map_from_room.Inverse();
  return walkers;
}

void TakeAll(const Walkers& walkers, MapJoiner& joiner) {
  for (const TeamKeyframe& each : walkers.own) joiner.Take(MapSide::kOwn, each);
  for (const TeamKeyframe& each : walkers.other) joiner.Take(MapSide::kOther, each);
}

TEST(MapJoiner, TwoMapsOfOneRoomBecomeOneWithinTwoSecondsOfACommonView) {  // T36
  const Walkers walkers = InOneRoom(1, /*metric=*/true);
  const WalkersResult result = LetMeet(walkers.own, walkers.other, walkers.own_from_other);
  ASSERT_TRUE(result.merged);
  EXPECT_LT(result.off_m, 0.02);
  EXPECT_LT(result.off_deg, 0.5);
  EXPECT_LT(result.nees, 60.0);  // six numbers
  EXPECT_LE(result.after_s - result.common_s, 2.0);
}

TEST(MapJoiner, FindsTheUnitOfAMapWithoutMetres) {
  const Walkers walkers = InOneRoom(2, /*metric=*/false);
  const WalkersResult there = LetMeet(walkers.own, walkers.other, walkers.own_from_other);
  const WalkersResult back = LetMeet(walkers.other, walkers.own, walkers.own_from_other.Inverse());
  for (const WalkersResult& result : {there, back}) {
    ASSERT_TRUE(result.merged);
    EXPECT_LT(result.off_m, 0.03);
    EXPECT_LT(result.off_deg, 0.7);
  }
}

TEST(MapJoiner, RoomsThatShareThingsStayTwo) {
  const nlohmann::ordered_json report = RunForeignRooms(/*pairs=*/5, /*seed=*/7);
  EXPECT_EQ(report["merged"], 0);
  EXPECT_EQ(report["same_room"]["merged"], report["same_room"]["pairs"]);
}

TEST(MapJoiner, DoesNotDependOnTheOrderOfArrivalNorOnWhatNeverCame) {  // T37
  const Walkers walkers = InOneRoom(3, /*metric=*/true);
  std::vector<std::pair<MapSide, TeamKeyframe>> delivered;
  std::mt19937_64 random(11);
  for (const auto& [side, all] :
       {std::pair{MapSide::kOwn, &walkers.own}, {MapSide::kOther, &walkers.other}}) {
    for (const TeamKeyframe& each : *all) {
      if (random() % 10 != 0) delivered.emplace_back(side, each);
    }
  }
  const auto told = [](const auto& each) { return each.second.told_time_ns; };
  const auto feed = [&](std::vector<std::pair<Timestamp, std::size_t>> order) {
    std::sort(order.begin(), order.end());
    MapJoiner joiner;
    for (const auto& [arrives_ns, index] : order) {
      joiner.Take(delivered[index].first, delivered[index].second);
      joiner.Work();
    }
    joiner.Work(/*all=*/true);
    EXPECT_EQ(joiner.late(), 0U);
    return joiner.join();
  };
  std::vector<std::pair<Timestamp, std::size_t>> in_order, shuffled;
  for (std::size_t k = 0; k < delivered.size(); ++k) {
    in_order.emplace_back(told(delivered[k]), k);
    shuffled.emplace_back(told(delivered[k]) + static_cast<Timestamp>(random() % 99'000'000), k);
  }
  const auto first = feed(in_order), second = feed(shuffled);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->fit.own_from_other.translation, second->fit.own_from_other.translation);
  EXPECT_EQ(first->fit.own_from_other.rotation.coeffs(),
            second->fit.own_from_other.rotation.coeffs());
  EXPECT_EQ(first->fit.covariance, second->fit.covariance);
  EXPECT_EQ(first->revision, second->revision);
}

TEST(MapJoiner, AMapThatIsThrownAwayIsAnotherMap) {
  const Walkers walkers = InOneRoom(4, /*metric=*/true);
  MapJoiner joiner;
  TakeAll(walkers, joiner);
  joiner.Work(/*all=*/true);
  ASSERT_TRUE(joiner.join());
  TeamKeyframe anew = walkers.other.front();
  anew.generation = 1;
  anew.told_time_ns += 60'000'000'000;
  joiner.Take(MapSide::kOther, anew);
  EXPECT_TRUE(joiner.Work(/*all=*/true));
  EXPECT_FALSE(joiner.join());
  EXPECT_EQ(joiner.book(MapSide::kOther).views().size(), 1U);
}

}  // namespace
}  // namespace saccade::map_joiner_test
