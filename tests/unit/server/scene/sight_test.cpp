// What hides landmarks, and where the light comes from.
#include "server/scene/sight.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/scene/light_fit.hpp"
#include "shared/models/overlay_things.hpp"
#include "shared/models/shapes.hpp"

namespace saccade::sight_test {
namespace {

using Eigen::Vector3d;

TEST(Sight, AThingHidesWhatIsBehindItAndNotWhatHangsOnIt) {
  TriangleMesh box;  // 1 m wide, 2 m tall, from z 1.8 to 2.2, standing on y = 1
  Append(BoxMesh({1.0, 2.0, 0.4}, 0xffffffff), {Eigen::Quaterniond::Identity(), {0, 1, 2}}, 1.0,
         box);
  const Sight sight(std::vector<TriangleMesh>{box});
  const Vector3d eye(0, 0, 0);
  EXPECT_TRUE(sight.Hides(eye, {0.2, 0.1, 3.0}));
  EXPECT_FALSE(sight.Hides(eye, {0.2, 0.1, 1.5}));       // before it
  EXPECT_FALSE(sight.Hides(eye, {0.2, 0.1, 1.8}));       // on it
  EXPECT_FALSE(sight.Hides(eye, {0.2, 0.1, 1.84}));      // its model is not exact
  EXPECT_TRUE(sight.Hides(eye, {0.2, 0.1, 1.95}));       // in it
  EXPECT_FALSE(sight.Hides(eye, {2.0, 0.1, 3.0}));       // beside it
  EXPECT_FALSE(sight.Hides(eye, {0.0, -3.0, 3.0}));      // above it
  EXPECT_TRUE(sight.Hides({0, 0, 4}, {0, 0, 0}));        // from the other side
  EXPECT_FALSE(sight.Hides({0, 0, 1.79}, {0, 0, 1.8}));  // nothing is so near
  const std::array<bool, 4> hidden =
      sight.Hides(eye, std::array<Vector3d, 4>{{{0, 0, 3}, {2, 0, 3}, {0.1, 0.1, 3}, {-2, 0, 3}}});
  EXPECT_EQ(hidden, (std::array<bool, 4>{true, false, true, false}));
}

TEST(Sight, OfAnEmptyWorldHidesNothing) {
  EXPECT_FALSE(Sight(std::vector<TriangleMesh>()).Hides({0, 0, 0}, {0, 0, 5}));
}

TEST(LightFit, FindsTheSideThatTheLightComesFromWhateverTheExposureDoes) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 0.01);
  const Vector3d truth(-0.3, -0.4, 0.1);
  LightFit fit;
  for (int picture = 0; picture < 40; ++picture) {
    const double exposure = 150.0 + 50.0 * std::sin(0.3 * picture);
    std::vector<PaperSeen> papers;
    for (const Vector3d& n :
         {Vector3d(0, 0, -1), Vector3d(1, 0, 0), Vector3d(0, -1, 0), Vector3d(0.6, 0, -0.8)}) {
      papers.push_back({n, exposure * (1.0 + n.dot(truth)) * (1.0 + noise(random))});
    }
    fit.Add(papers);
  }
  const SceneLight light = fit.light();
  EXPECT_LT((light.toward_in_world - truth).norm(), 0.06) << light.toward_in_world.transpose();
  EXPECT_GT(light.confidence, 0.9);
}

TEST(LightFit, WithoutEvidenceItIsNeutral) {
  LightFit fit;
  EXPECT_EQ(fit.light().confidence, 0.0);
  EXPECT_EQ(fit.light().toward_in_world, Vector3d::Zero());
  for (int picture = 0; picture < 40; ++picture) {
    const std::vector<PaperSeen> one_wall = {{{0, 0, -1}, 180}, {{0, 0, -1}, 190}};
    fit.Add(one_wall);
    fit.Add(std::vector<PaperSeen>{{{0, 0, -1}, 255}, {{1, 0, 0}, 3}});  // blown out, black
  }
  EXPECT_LT(fit.light().confidence, 0.05);
  EXPECT_LT(fit.light().toward_in_world.norm(), 0.02);
}

TEST(OverlayThings, LieWhereTheyAreSaidToBe) {
  const std::vector<Vector3d> way = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}};
  for (const Eigen::Vector3f& p : TubeMesh(way, 0.02, 0xff0000ff).positions) {
    // About one of the two legs, or the bend between them.
    const double to_first = std::hypot(p.x(), p.y());
    const double to_second = std::hypot(p.z() - 1.0, p.y());
    EXPECT_LT(std::min(to_first, to_second), 0.035);
  }
  for (const Eigen::Vector3f& p : FloorGridMesh(2, 1, 0.25, 0xffffffff).positions) {
    EXPECT_LT(p.y(), 0);  // above the floor, by less than anybody sees
    EXPECT_GT(p.y(), -0.01);
    EXPECT_LT(std::abs(p.x()), 1.01);
    EXPECT_LT(std::abs(p.z()), 0.51);
  }
  EXPECT_EQ(FloorGridMesh(2, 1, 0.25, 0xffffffff).triangles.size(), 2u * (9 + 5));
  const TriangleMesh route = RouteMesh(way, 0.2, 0xffffffff);
  EXPECT_GE(route.triangles.size(), 4u * 5);
  double nearest = 1e9;
  for (const Eigen::Vector3f& p : ArrowMesh({1, 0, 0}, {0, 0, 0}, 0.02, 0xff0000ff).positions) {
    nearest = std::min(nearest, static_cast<double>(p.norm()));
  }
  EXPECT_LT(nearest, 1e-6);  // its tip touches what it points at
}

TEST(OverlayThings, APictureHangsUpright) {
  const std::vector<std::uint32_t> pixels = {0xff0000ff, 0x00ff00ff, 0x0000ffff,
                                             0xffffffff, 0x000000ff, 0x808080ff};
  const TriangleMesh picture = PictureMesh(pixels, 3, 0.6);
  ASSERT_EQ(picture.triangles.size(), 12u);
  EXPECT_EQ(picture.colors_rgba.front(), 0xff0000ffu);
  const Eigen::Vector3f& first = picture.positions[picture.triangles[0][0]];
  EXPECT_NEAR(first.x(), -0.3, 1e-6);  // the first pixel at the left, on top
  EXPECT_NEAR(first.y(), -0.4, 1e-6);
  EXPECT_TRUE(PictureMesh(pixels, 0, 0.6).empty());
}

}  // namespace
}  // namespace saccade::sight_test
