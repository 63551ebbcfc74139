#include "server/rpc/deltas.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::deltas_test {
namespace {

using testing::MakeTracked;

MapSnapshot MakeMap(std::initializer_list<FeatureId> ids) {
  MapSnapshot map;
  for (const FeatureId id : ids) {
    FeatureSnapshot feature;
    feature.id = id;
    feature.point_in_world = Eigen::Vector3d(static_cast<double>(id), 0, 1);
    feature.covariance_in_world = 1e-4 * Eigen::Matrix3d::Identity();
    map.features.push_back(feature);
  }
  return map;
}

// One reader that is given every map of one log.
class MapDelta : public ::testing::Test {
 protected:
  bool Next(const MapSnapshot& map, v1::MapDelta& delta) {
    TrackedEvent event = MakeTracked(0);
    event.snapshot = std::make_shared<MapSnapshot>(map);
    return reader_.Next(log_.Next(event, 0), delta);
  }
  ChangeLog log_;
  MapReader reader_;
};

TEST_F(MapDelta, TheFirstDeltaIsFullAndAnUnchangedMapIsSilent) {
  v1::MapDelta delta;
  ASSERT_TRUE(Next(MakeMap({1, 2}), delta));
  EXPECT_TRUE(delta.full());
  EXPECT_EQ(delta.upserted_size(), 2);
  EXPECT_FALSE(Next(MakeMap({1, 2}), delta));
}

TEST_F(MapDelta, SendsWhatChangedAndWhatWent) {
  v1::MapDelta delta;
  Next(MakeMap({1, 2, 3}), delta);
  MapSnapshot map = MakeMap({1, 3, 4});
  map.features[0].state = FeatureState::kMeasured;
  map.features[1].point_in_world.x() += 1e-5;  // a hundredth of sigma: not worth a byte
  ASSERT_TRUE(Next(map, delta));
  EXPECT_FALSE(delta.full());
  ASSERT_EQ(delta.upserted_size(), 2);
  EXPECT_EQ(delta.upserted(0).id(), 4u) << "new ones first";
  EXPECT_EQ(delta.upserted(1).id(), 1u);
  EXPECT_THAT(delta.removed_ids(), ::testing::ElementsAre(2u));
}

TEST_F(MapDelta, SmallMovesAddUpUntilTheyAreSent) {
  v1::MapDelta delta;
  MapSnapshot map = MakeMap({1});
  Next(map, delta);
  bool sent = false;
  for (int i = 0; i < 100 && !sent; ++i) {
    map.features[0].point_in_world.x() += 1e-4;
    sent = Next(map, delta);
  }
  EXPECT_TRUE(sent);
}

TEST_F(MapDelta, ANewMapIsFullAgain) {
  v1::MapDelta delta;
  Next(MakeMap({1, 2}), delta);
  MapSnapshot map = MakeMap({1});
  map.map_generation = 1;
  ASSERT_TRUE(Next(map, delta));
  EXPECT_TRUE(delta.full());
  EXPECT_EQ(delta.upserted_size(), 1);
  EXPECT_EQ(delta.removed_ids_size(), 0);
}

// A receiver that applies every delta has the server's map.
TEST_F(MapDelta, DeltasAddUpToTheMap) {
  std::mt19937 random(3);
  std::uniform_int_distribution<FeatureId> pick(0, 29);
  v1::MapDelta delta;
  std::map<FeatureId, double> received;
  MapSnapshot map;
  for (int round = 0; round < 300; ++round) {
    const FeatureId id = pick(random);
    const auto same = [id](const FeatureSnapshot& feature) { return feature.id == id; };
    if (std::erase_if(map.features, same) == 0) {
      FeatureSnapshot feature;
      feature.id = id;
      feature.point_in_world.x() = round;
      map.features.push_back(feature);
    }
    if (!Next(map, delta)) continue;
    for (const auto removed : delta.removed_ids()) received.erase(removed);
    for (const v1::Feature& feature : delta.upserted()) {
      received[feature.id()] = feature.point_in_world_m().x();
    }
    std::map<FeatureId, double> expected;
    for (const auto& feature : map.features) expected[feature.id] = feature.point_in_world.x();
    ASSERT_EQ(received, expected) << "round " << round;
  }
}

TEST(AnnotationDelta, EditsGoAtOnceAndNoiseDoesNot) {
  ChangeLog log;
  AnnotationReader reader;
  v1::AnnotationEvent delta;
  TrackedEvent event = MakeTracked(1);
  Annotation note;
  note.id = "a";
  note.anchor.point_in_world = {0, 0, 1};
  note.anchor.error_m = 0.01;
  const auto publish = [&](Timestamp now_ns) {
    event.annotations = std::make_shared<AnnotationList>(1, note);
    return reader.Next(log.Next(event, now_ns), delta);
  };
  ASSERT_TRUE(publish(0));
  EXPECT_TRUE(delta.full());
  EXPECT_FALSE(publish(1));
  note.anchor.point_in_world.x() += 1e-5;  // 0.005 px
  EXPECT_FALSE(publish(2));
  note.anchor.point_in_world.x() += 2e-3;  // 1 px
  EXPECT_TRUE(publish(3));
  EXPECT_FALSE(delta.full());
  note.revision = 1;
  EXPECT_TRUE(publish(4));
  note.anchor.error_m = 0.02;
  EXPECT_FALSE(publish(5));
  EXPECT_TRUE(publish(300'000'000));
  note.anchor.state = AnchorState::kPaused;
  EXPECT_TRUE(publish(300'000'001));
  note.anchor.reason = "in other words";
  EXPECT_FALSE(publish(300'000'002));
  EXPECT_TRUE(publish(1'400'000'000)) << "words alone go once a second";
  event.annotations = std::make_shared<AnnotationList>();
  ASSERT_TRUE(reader.Next(log.Next(event, 1'400'000'001), delta));
  EXPECT_THAT(delta.removed_ids(), ::testing::ElementsAre("a"));
}

}  // namespace
}  // namespace saccade::deltas_test
