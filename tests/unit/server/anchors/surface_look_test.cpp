#include "server/anchors/surface_look.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace saccade::surface_look_test {
namespace {

constexpr double kPerPixel = 1.0 / 500;

/// Flat pieces that face the origin, each `across` wide, at x, y and the depth z.
struct Piece {
  double x, y, z, across;
};
SurfaceSnapshot Pieces(const std::vector<Piece>& pieces) {
  SurfaceSnapshot surface;
  surface.edition = 1;
  surface.voxel = 0.015f;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const Piece& piece = pieces[k];
    SurfaceChunk chunk;
    chunk.index = {static_cast<std::int32_t>(k), 0, 0};
    chunk.origin_in_world =
        Eigen::Vector3d(piece.x - piece.across / 2, piece.y - piece.across / 2, piece.z)
            .cast<float>();
    chunk.step_m = static_cast<float>(piece.across / 1000);
    chunk.positions = {{0, 0, 0}, {1000, 0, 0}, {0, 1000, 0}, {1000, 1000, 0}};
    chunk.colors_rgb.assign(4, {1, 2, 3});
    chunk.triangles = {{0, 2, 1}, {1, 2, 3}};
    surface.chunks[chunk.index] = std::make_shared<const SurfaceChunk>(chunk);
  }
  return surface;
}

std::optional<SurfaceLook> Look(const SurfaceSnapshot& surface, const Eigen::Vector3d& at) {
  return LookAtSurface(surface, Eigen::Vector3d::Zero(), at.normalized(), kPerPixel);
}

TEST(SurfaceLook, OneSurfaceAnOutlineAndAHole) {
  const SurfaceSnapshot surface = Pieces({{0, 0, 2, 2}, {0.3, 0, 1.2, 0.2}});
  const auto wall = Look(surface, {-0.4, 0.2, 2});
  ASSERT_TRUE(wall);
  EXPECT_FALSE(wall->outline);
  EXPECT_NEAR(wall->range_m, Eigen::Vector3d(-0.4, 0.2, 2).norm(), 1e-5);
  EXPECT_LT(wall->normal_in_world.z(), -0.99);
  EXPECT_NEAR(wall->sigma_m / wall->range_m, 0.01, 0.005);
  const auto edge = Look(surface, {0.205, 0, 1.2});  // 5 mm inside of what stands before
  ASSERT_TRUE(edge);
  EXPECT_TRUE(edge->outline);
  EXPECT_NEAR(edge->range_m, 1.217, 0.01);
  EXPECT_NEAR(edge->other_range_m, 2.03, 0.05);
  const auto end = Look(surface, {0.998, 0, 2});  // beside it nothing is known
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->outline);
  EXPECT_EQ(end->other_range_m, 0.0);
  EXPECT_FALSE(Look(surface, {1.2, 0, 2}));
}

TEST(SurfaceLook, ASlantIsNoOutline) {
  SurfaceSnapshot surface;
  surface.voxel = 0.015f;
  SurfaceChunk floor;
  floor.origin_in_world = {-3, 0.8f, 0};
  floor.step_m = 0.01f;
  floor.positions = {{0, 0, 0}, {600, 0, 0}, {0, 0, 900}, {600, 0, 900}};
  floor.colors_rgb.assign(4, {1, 2, 3});
  floor.triangles = {{0, 1, 2}, {1, 3, 2}};
  surface.chunks[{}] = std::make_shared<const SurfaceChunk>(floor);
  const auto look = Look(surface, {0, 0.8, 2.5});
  ASSERT_TRUE(look);
  EXPECT_FALSE(look->outline);
}

TEST(SurfaceLook, AroundAHoleThePlaneGoesOn) {
  // A wall with a bare middle.
  std::vector<Piece> frame;
  for (const double x : {-0.45, 0.0, 0.45}) {
    for (const double y : {-0.45, 0.0, 0.45}) {
      if (x != 0 || y != 0) frame.push_back({x, y, 2.0, 0.4});
    }
  }
  const SurfaceSnapshot surface = Pieces(frame);
  ASSERT_FALSE(Look(surface, {0.02, 0.03, 2}));
  const auto samples = SurfaceAround(surface, Rigid3(), kPerPixel);
  ASSERT_GE(samples.size(), 6u);
  const auto depth = EstimateDepth(samples, kPerPixel, /*metric=*/true, AnchorOptions());
  ASSERT_TRUE(depth);
  EXPECT_EQ(depth->method, AnchorMethod::kPlane);
  EXPECT_NEAR(depth->depth_m, 2.0, 0.02);
}

TEST(TakeSurface, ItComesFirstButForAFinerFeatureThatAgrees) {
  SurfaceLook look;
  look.range_m = 2.0;
  look.sigma_m = 0.02;
  SurfaceDepth depth;
  depth.method = AnchorMethod::kFeature;
  depth.depth_m = 2.01;
  depth.sigma_m = 0.008;
  depth.at_feature = 3;
  DepthDoubt doubt;
  SurfaceDepth fine = depth;
  TakeSurface(look, fine, doubt);
  EXPECT_EQ(fine.method, AnchorMethod::kFeature);
  EXPECT_EQ(fine.depth_m, 2.01);
  SurfaceDepth wrong = depth;
  wrong.depth_m = 2.6;
  TakeSurface(look, wrong, doubt);
  EXPECT_EQ(wrong.method, AnchorMethod::kScene);
  EXPECT_EQ(wrong.depth_m, 2.0);
  EXPECT_FALSE(wrong.at_feature);
  look.outline = true;
  look.other_range_m = 3.0;
  SurfaceDepth edge = depth;
  TakeSurface(look, edge, doubt);
  EXPECT_EQ(edge.method, AnchorMethod::kFeature);
  EXPECT_GT(doubt.relief_sigma_m, 0.2);
}

}  // namespace
}  // namespace saccade::surface_look_test
