#include "server/map/dormant_landmarks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/pinhole.hpp"

namespace saccade::dormant_landmarks_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A wall 2 m in front of the origin, seen from two keyframes: 0 straight on, 1 a metre aside.
class DormantLandmarksTest : public ::testing::Test {
 protected:
  void Put(FeatureId id, KeyframeId keyframe, const Eigen::Vector3d& point, int matched = 20,
           std::int64_t rests_until = 0, bool seeded = false) {
    const Rigid3 pose{Eigen::Quaterniond::Identity(),
                      Eigen::Vector3d(static_cast<double>(keyframe), 0, 0)};
    const Eigen::Vector3d seen = pose.Inverse() * point;
    known_[id] = {keyframe, pose, {seen.normalized(), 1.0 / seen.norm()}, 1e-3};
    DormantLandmark dormant;
    dormant.landmark.id = id;
    dormant.landmark.matched = static_cast<std::uint32_t>(matched);
    dormant.landmark.seeded = seeded;
    dormant.rests_until = rests_until;
    dormant_.Put(std::move(dormant));
  }

  /// Four in a row, around `x` on the wall.
  void PutFour(FeatureId first, KeyframeId keyframe, double x) {
    for (int k = 0; k < 4; ++k) Put(first + k, keyframe, {x + 0.1 * k, 0.05 * k, 2});
  }

  std::vector<FeatureId> Seen(const Rigid3& from, int wanted = 100, std::int64_t frame = 0,
                              std::vector<Eigen::Vector2d> occupied = {}) {
    std::vector<FeatureId> ids;
    dormant_.Locate(Version(), Lookup());
    for (const auto& [keyframe, group] : dormant_.InView(camera_, from, frame, wanted, occupied)) {
      ids.insert(ids.end(), group.begin(), group.end());
    }
    return ids;
  }
  DormantLandmarks::Lookup Lookup() const {
    return [this](FeatureId id) -> std::optional<KeyframeGraph::Recalled> {
      const auto at = known_.find(id);
      return at == known_.end() ? std::nullopt : std::optional(at->second);
    };
  }

  DormantLandmarks::VersionOf Version() const {
    return [this](KeyframeId) { return version_; };
  }

  std::uint64_t version_ = 1;
  CameraModel camera_{Pinhole(640, 480, 500)};
  std::map<FeatureId, KeyframeGraph::Recalled> known_;
  DormantLandmarks dormant_{DormantOptions()};
};

TEST_F(DormantLandmarksTest, FindsWhatShouldBeInView) {
  PutFour(1, 0, -0.2);
  PutFour(11, 0, 3.0);  // beyond the picture's border
  Put(21, 0, {0, 0, -2});
  EXPECT_THAT(Seen(Rigid3()), ElementsAre(1, 2, 3, 4));
  const Rigid3 away{Eigen::Quaterniond(Eigen::AngleAxisd(-1.5, Eigen::Vector3d::UnitY())),
                    Eigen::Vector3d::Zero()};
  EXPECT_THAT(Seen(away), IsEmpty());
}

TEST_F(DormantLandmarksTest, LeavesWhatWouldLookDifferent) {
  PutFour(1, 0, -0.2);
  const auto from = [](double x, double z, double turn) {
    return Rigid3{Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())),
                  Eigen::Vector3d(x, 0, z)};
  };
  EXPECT_EQ(Seen(from(0, 0.9, 0)).size(), 4u);
  EXPECT_THAT(Seen(from(0, 1.3, 0)), IsEmpty()) << "three times as large";
  EXPECT_THAT(Seen(from(0, -2.5, 0)), IsEmpty()) << "less than half as large";
  EXPECT_THAT(Seen(from(2.5, 0, -0.9)), IsEmpty()) << "50 deg from aside";
}

TEST_F(DormantLandmarksTest, LeavesWhatIsInViewAlreadyAndWhatRests) {
  PutFour(1, 0, -0.2);
  Put(5, 0, {0, -0.2, 2}, 20, /*rests_until=*/100);
  const std::vector<Eigen::Vector2d> at = {{320 - 0.1 * 250 + 3, 240 + 0.05 * 250}};
  PutFour(31, 1, 0.3);
  EXPECT_THAT(Seen(Rigid3(), 100, 50), ElementsAre(1, 2, 3, 4, 31, 32, 33, 34));
  EXPECT_THAT(Seen(Rigid3(), 100, 50, at), ElementsAre(31, 32, 33, 34)) << "three are too few";
  EXPECT_THAT(Seen(Rigid3(), 100, 100, at), ElementsAre(1, 3, 4, 5, 31, 32, 33, 34));
}

TEST_F(DormantLandmarksTest, TheKeyframeThatShowsMostComesFirst) {
  PutFour(1, 0, -0.4);
  PutFour(11, 1, 0.1);
  Put(15, 1, {0.3, -0.2, 2});
  EXPECT_THAT(Seen(Rigid3(), 4), ElementsAre(11, 12, 13, 14, 15));
  EXPECT_THAT(Seen(Rigid3(), 9), ElementsAre(11, 12, 13, 14, 15, 1, 2, 3, 4));
}

TEST_F(DormantLandmarksTest, OneThatAMarkWaitsForIsWorthAPoseAlone) {
  Put(1, 0, {0, 0, 2});
  Put(2, 1, {0.2, 0, 2}, 20, 0, /*seeded=*/true);
  EXPECT_THAT(Seen(Rigid3()), ElementsAre(2));
}

TEST_F(DormantLandmarksTest, AsksOnlyAboutKeyframesThatChanged) {
  PutFour(1, 0, -0.2);
  PutFour(11, 1, 0.1);
  int asked = 0;
  std::map<KeyframeId, std::uint64_t> versions = {{0, 1}, {1, 2}};
  const auto version = [&](KeyframeId id) { return versions[id]; };
  const auto lookup = [&](FeatureId id) {
    ++asked;
    return Lookup()(id);
  };
  dormant_.Locate(version, lookup);
  EXPECT_EQ(asked, 8);
  dormant_.Locate(version, lookup);
  EXPECT_EQ(asked, 8);
  known_[12].world_from_anchor.translation.y() += 0.5;
  versions[1] = 3;
  dormant_.Locate(version, lookup);
  EXPECT_EQ(asked, 12);
  EXPECT_NEAR(dormant_.all().at(12).place.point_in_world.y(), 0.55, 1e-9);
}

TEST_F(DormantLandmarksTest, IsBoundedAndForgetsWithTheGraph) {
  DormantOptions options;
  options.max_landmarks = 3;
  dormant_ = DormantLandmarks(options);
  Put(1, 0, {0, 0, 2}, 50);
  Put(2, 0, {0, 0, 2}, 10);
  Put(3, 0, {0, 0, 2}, 30);
  Put(4, 0, {0, 0, 2}, 40);
  EXPECT_EQ(dormant_.size(), 3u);
  EXPECT_FALSE(dormant_.Has(2)) << "matched least";
  dormant_.Locate(Version(), Lookup());
  EXPECT_TRUE(dormant_.Has(3));
  known_.erase(3);
  ++version_;
  dormant_.Locate(Version(), Lookup());
  EXPECT_FALSE(dormant_.Has(3));
  EXPECT_EQ(dormant_.Take(1).landmark.matched, 50u);
  EXPECT_FALSE(dormant_.Has(1));
}

}  // namespace
}  // namespace saccade::dormant_landmarks_test
