#include "server/sim/room.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <set>

#include "server/sim/ray_caster.hpp"
#include "server/sim/wearer.hpp"

namespace saccade::room_test {
namespace {

const RoomScene& Room() {
  static const RoomScene* const scene = new RoomScene(BuildRoom(1));
  return *scene;
}

TEST(Room, IsFourByFourByTwoAndAHalfMetres) {
  Eigen::Array3f low = Eigen::Array3f::Constant(1e9f), high = -low;
  for (const SurfacePatch& patch : Room().patches) {
    for (const Eigen::Vector3f& p : patch.positions) {
      low = low.min(p.array());
      high = high.max(p.array());
    }
  }
  EXPECT_NEAR(high[0] - low[0], 4.0, 0.01);
  EXPECT_NEAR(high[1] - low[1], 2.5, 0.01);
  EXPECT_NEAR(high[2] - low[2], 4.0, 0.01);
}

TEST(Room, FollowsFromItsSeed) {
  const RoomScene again = BuildRoom(1), other = BuildRoom(2);
  EXPECT_EQ(cv::norm(Room().light, again.light, cv::NORM_INF), 0);
  ASSERT_EQ(Room().textures.size(), again.textures.size());
  ASSERT_EQ(Room().textures.size(), other.textures.size());
  int changed = 0;
  for (std::size_t k = 0; k < again.textures.size(); ++k) {
    EXPECT_EQ(cv::norm(Room().textures[k].bgr, again.textures[k].bgr, cv::NORM_INF), 0);
    changed += cv::norm(Room().textures[k].bgr, other.textures[k].bgr, cv::NORM_INF) > 0;
  }
  EXPECT_GT(changed, 30);
}

TEST(Room, NamesManyPointsOnceEach) {
  std::set<std::string> names;
  for (const NamedPoint& object : Room().objects) EXPECT_TRUE(names.insert(object.name).second);
  EXPECT_GE(names.size(), 25u);
}

/// Distance of `p` from the triangle's plane patch, by sampling the patch finely enough.
TEST(Room, NamedPointsLieOnPaintedSurfaces) {
  const RayCaster caster(Room());
  for (const NamedPoint& object : Room().objects) {
    const Eigen::Vector3f point = object.point_in_world.cast<float>();
    // From somewhere off the surface a ray meets the point itself within a millimetre.
    float nearest = 1;
    for (int k = 0; k < 200; ++k) {
      const float z = 1 - (2 * static_cast<float>(k) + 1) / 200;
      const float r = std::sqrt(1 - z * z), a = 2.39996f * static_cast<float>(k);
      const Eigen::Vector3f away(r * std::cos(a), r * std::sin(a), z);
      const auto hit = caster.Closest(point + 0.05f * away, -away);
      if (hit && hit->front) nearest = std::min(nearest, std::abs(hit->distance - 0.05f));
    }
    EXPECT_LT(nearest, 0.001f) << object.name;
  }
}

TEST(Room, HasTextureToTrackAroundTheDesk) {
  // Posters, books and things carry contrast; plain walls do not fill the place.
  int rich = 0;
  for (const SurfaceTexture& texture : Room().textures) {
    cv::Mat grey;
    cv::cvtColor(texture.bgr, grey, cv::COLOR_BGR2GRAY);
    cv::Scalar mean, deviation;
    cv::meanStdDev(grey, mean, deviation);
    rich += deviation[0] > 20;
  }
  EXPECT_GE(rich, 20);
}

TEST(RayCaster, HitsWhatAWallIsMadeOf) {
  const RayCaster caster(Room());
  // From the middle of the room towards the floor and the ceiling.
  const Eigen::Vector3d middle = WorldFromRoom() * Eigen::Vector3d(2.0, 1.2, 2.9);
  const auto floor = caster.Closest(middle.cast<float>(), {0, 1, 0});
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->distance, 1.2, 1e-3);
  EXPECT_TRUE(floor->front);
  const auto ceiling = caster.Closest(middle.cast<float>(), {0, -1, 0});
  ASSERT_TRUE(ceiling);
  EXPECT_NEAR(ceiling->distance, 1.3, 0.02);
  EXPECT_TRUE(caster.Blocked(middle.cast<float>(), {0, 1, 0}, 1.3f));
  EXPECT_FALSE(caster.Blocked(middle.cast<float>(), {0, 1, 0}, 1.1f));
}

}  // namespace
}  // namespace saccade::room_test
