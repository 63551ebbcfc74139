#include "shared/wire/surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "shared/scene/surface_ray.hpp"

namespace saccade::surface_test {
namespace {

using ::testing::HasSubstr;

constexpr int kAcross = 40;  // corners

/// A wave over the plane z = 1 [m].
SurfaceChunk Wave() {
  SurfaceChunk chunk;
  chunk.index = {3, -2, 1};
  chunk.version = 17;
  chunk.origin_in_world = {-1.0f, -1.0f, 0.5f};
  chunk.step_m = 1e-4f;
  for (int y = 0; y < kAcross; ++y) {
    for (int x = 0; x < kAcross; ++x) {
      const double high = 5'000.0 + 300.0 * std::sin(0.4 * x) * std::cos(0.3 * y);
      chunk.positions.push_back({static_cast<std::uint16_t>(500 * x),
                                 static_cast<std::uint16_t>(500 * y),
                                 static_cast<std::uint16_t>(high)});
      chunk.colors_rgb.push_back(
          {static_cast<std::uint8_t>(6 * x), static_cast<std::uint8_t>(6 * y), 40});
    }
  }
  for (int y = 0; y + 1 < kAcross; ++y) {
    for (int x = 0; x + 1 < kAcross; ++x) {
      const auto at = static_cast<std::uint16_t>(y * kAcross + x);
      const auto add = [&](int a, int b, int c) {
        chunk.triangles.push_back({static_cast<std::uint16_t>(at + a),
                                   static_cast<std::uint16_t>(at + b),
                                   static_cast<std::uint16_t>(at + c)});
      };
      add(0, kAcross, 1);
      add(1, kAcross, kAcross + 1);
    }
  }
  return chunk;
}

/// Corners of each triangle with their colours, each beginning with its least, sorted: the same
/// surface whatever the order, with the same side in front.
using Corner = std::array<int, 6>;
std::vector<std::array<Corner, 3>> Listed(const SurfaceChunk& chunk) {
  std::vector<std::array<Corner, 3>> all;
  for (const SurfaceChunk::Triangle& triangle : chunk.triangles) {
    std::array<Corner, 3> one;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = chunk.positions.at(triangle[k]);
      const auto& c = chunk.colors_rgb.at(triangle[k]);
      one[k] = {p[0], p[1], p[2], c[0], c[1], c[2]};
    }
    std::rotate(one.begin(), std::min_element(one.begin(), one.end()), one.end());
    all.push_back(one);
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST(WireSurface, ComesBackWithEveryTriangleAndItsFrontInFront) {
  const SurfaceChunk in = Wave();
  const v1::SurfaceChunk coded = wire::ToProto(in);
  EXPECT_EQ(coded.triangle_count(), in.triangles.size());
  const auto out = wire::FromProto(coded);
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->index, in.index);
  EXPECT_EQ(out->origin_in_world, in.origin_in_world);
  EXPECT_EQ(out->step_m, in.step_m);
  EXPECT_EQ(Listed(*out), Listed(in));
  const std::size_t plain = 9 * in.positions.size() + 6 * in.triangles.size();
  EXPECT_LT(coded.ByteSizeLong(), plain / 2) << "it is not worth its decoding";
}

TEST(WireSurface, NothingIsThereAnyMore) {
  SurfaceChunk in;
  in.index = {1, 2, 3};
  const auto out = wire::FromProto(wire::ToProto(in));
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->index, in.index);
  EXPECT_TRUE(out->triangles.empty());
}

TEST(WireSurface, WhatIsWrongIsNamed) {
  const v1::SurfaceChunk good = wire::ToProto(Wave());
  const auto why = [](const v1::SurfaceChunk& chunk) {
    return std::string(wire::FromProto(chunk).status().message());
  };
  v1::SurfaceChunk chunk = good;
  chunk.set_corner_count(70'000);
  EXPECT_THAT(why(chunk), HasSubstr("corner_count"));
  chunk = good;
  chunk.set_triangle_count(4'000'000'000u);
  EXPECT_THAT(why(chunk), HasSubstr("triangle_count"));
  chunk = good;
  chunk.set_step_m(std::nanf(""));
  EXPECT_THAT(why(chunk), HasSubstr("step_m"));
  chunk = good;
  chunk.mutable_corners()->resize(good.corners().size() / 2);
  EXPECT_THAT(why(chunk), HasSubstr("corners"));
  chunk = good;
  chunk.mutable_triangles()->resize(good.triangles().size() / 2);
  EXPECT_THAT(why(chunk), HasSubstr("triangles"));
  chunk = good;
  chunk.set_corner_count(4);
  EXPECT_FALSE(wire::FromProto(chunk).ok());
}

TEST(WireSurface, DamagedBytesAreRefusedOrAreASurface) {
  const v1::SurfaceChunk good = wire::ToProto(Wave());
  std::mt19937 rng(3);
  const auto damage = [&rng](std::string& bytes) {
    const int times = std::uniform_int_distribution<int>(1, 6)(rng);
    for (int k = 0; k < times && !bytes.empty(); ++k) {
      bytes[std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(rng)] =
          static_cast<char>(rng());
    }
  };
  for (int k = 0; k < 2'000; ++k) {
    v1::SurfaceChunk chunk = good;
    damage(*chunk.mutable_corners());
    damage(*chunk.mutable_triangles());
    const auto out = wire::FromProto(chunk);
    if (!out.ok()) continue;
    for (const SurfaceChunk::Triangle& triangle : out->triangles) {
      for (const std::uint16_t corner : triangle) ASSERT_LT(corner, out->positions.size());
    }
  }
}

SurfaceSnapshot Both(const SurfaceChunk& one, const SurfaceChunk& other) {
  SurfaceSnapshot surface;
  surface.chunks[one.index] = std::make_shared<const SurfaceChunk>(one);
  surface.chunks[other.index] = std::make_shared<const SurfaceChunk>(other);
  return surface;
}

TEST(SurfaceRay, MeetsTheNearestOfTwoAndNothingBeside) {
  SurfaceChunk far = Wave();
  far.index = {0, 0, 9};
  far.origin_in_world.z() += 1.0f;
  const SurfaceSnapshot surface = Both(Wave(), far);
  const Eigen::Vector3d eye(-0.3, -0.2, -1.0);
  const auto hit = CastOnSurface(surface, eye, Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range, 2.0, 0.031);  // the wave is 3 cm high
  EXPECT_LT(hit->normal_in_world.z(), -0.8);
  const auto behind = CastOnSurface(surface, eye, Eigen::Vector3d::UnitZ(), hit->range + 0.1);
  ASSERT_TRUE(behind);
  EXPECT_NEAR(behind->range, hit->range + 1.0, 1e-4);
  EXPECT_FALSE(CastOnSurface(surface, eye, -Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(CastOnSurface(surface, {1.5, 0.0, -1.0}, Eigen::Vector3d::UnitZ()));
}

TEST(SurfaceRay, SlantedRaysMeetWhatTheyPass) {
  const SurfaceSnapshot surface = Both(Wave(), Wave());
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> within(-0.9, 0.85), away(-2.0, 2.0);
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d on(within(rng), within(rng), 1.0), eye(away(rng), away(rng), -1.5);
    const Eigen::Vector3d ray = (on - eye).normalized();
    const auto hit = CastOnSurface(surface, eye, ray);
    ASSERT_TRUE(hit) << k;
    EXPECT_NEAR((eye + hit->range * ray).z(), 1.0, 0.031);
    EXPECT_LT(hit->normal_in_world.dot(ray), 0.0);
  }
}

}  // namespace
}  // namespace saccade::surface_test
