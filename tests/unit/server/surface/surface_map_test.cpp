#include "server/surface/surface_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "server/surface/depth_map.hpp"

namespace saccade::surface_map_test {
namespace {

using ::testing::HasSubstr;

constexpr float kWall_m = 2.0f, kBox_m = 1.4f;  // depths of the two surfaces that there are
constexpr double kDistance_m = 1.8;

/// A fixed number in 0 .. 1 for each point of a lattice.
float Lattice(int x, int y) {
  std::uint32_t h =
      static_cast<std::uint32_t>(x) * 374761393u + static_cast<std::uint32_t>(y) * 668265263u;
  h = (h ^ (h >> 13)) * 1274126177u;
  return static_cast<float>((h ^ (h >> 16)) & 0xffff) / 65535.0f;
}

float Texture(float x, float y) {
  const auto x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0);
  return (Lattice(x0, y0) * (1 - u) + Lattice(x0 + 1, y0) * u) * (1 - v) +
         (Lattice(x0, y0 + 1) * (1 - u) + Lattice(x0 + 1, y0 + 1) * u) * v;
}

/// A box before a wall; above y = -0.45 m the wall is white and bare.
struct Room {
  static bool OnBox(float x, float y) { return std::abs(x) < 0.35f && std::abs(y) < 0.25f; }
  static bool Bare(float y) { return y < -0.45f; }
  /// Depth and brightness along a ray.
  static std::pair<float, float> Look(const Eigen::Vector3f& eye, const Eigen::Vector3f& ray) {
    const Eigen::Vector3f near = eye + (kBox_m - eye.z()) / ray.z() * ray;
    if (OnBox(near.x(), near.y())) {
      return {kBox_m, 40.0f + 170.0f * Texture(near.x() / 0.05f + 31.0f, near.y() / 0.05f)};
    }
    const Eigen::Vector3f far = eye + (kWall_m - eye.z()) / ray.z() * ray;
    if (Bare(far.y())) return {kWall_m, 220.0f};
    return {kWall_m, 40.0f + 170.0f * Texture(far.x() / 0.07f, far.y() / 0.07f)};
  }
};

std::shared_ptr<const CameraModel> Lens() {
  CameraIntrinsics lens;
  lens.width = 320;
  lens.height = 240;
  lens.fx = lens.fy = 228.0;
  lens.cx = 159.5;
  lens.cy = 119.5;
  return std::make_shared<CameraModel>(lens);
}

/// Nine keyframes, 0.12 m apart, looking straight at the wall.
struct Walk {
  Walk() {
    const auto lens = Lens();
    places.generation = 1;
    places.metric = true;
    for (int k = 0; k < 9; ++k) {
      KeyframePlace place;
      place.id = k;
      place.frame = static_cast<FrameId>(10 * k);
      place.distance_m = kDistance_m;
      place.world_from_camera.translation = {0.12 * (k % 3) - 0.12, 0.12 * (k / 3) - 0.12, 0.0};
      Frame frame;
      frame.id = place.frame;
      frame.camera = lens;
      frame.grey.create(240, 320, CV_8U);
      for (int y = 0; y < 240; ++y) {
        for (int x = 0; x < 320; ++x) {
          const Eigen::Vector3f ray((static_cast<float>(x) - 159.5f) / 228.0f,
                                    (static_cast<float>(y) - 119.5f) / 228.0f, 1.0f);
          frame.grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
              Room::Look(place.world_from_camera.translation.cast<float>(), ray).second);
        }
      }
      places.keyframes.push_back(place);
      frames.push_back(frame);
    }
  }
  /// As they were when frame `k` came.
  KeyframePlaces Until(std::size_t k) const {
    KeyframePlaces then = places;
    then.keyframes.resize(k + 1);
    return then;
  }
  KeyframePlaces places;
  std::vector<Frame> frames;
};

const Walk& TheWalk() {
  static const Walk walk;
  return walk;
}

SurfaceOptions Options() {
  SurfaceOptions options;
  options.width_px = 160;
  options.planes = 48;
  return options;
}

std::unique_ptr<SurfaceMap> MapOf(const Walk& walk, const SurfaceOptions& options = Options(),
                                  bool worked = true) {
  auto map = SurfaceMap::Create(options);
  EXPECT_TRUE(map.ok()) << map.status();
  for (std::size_t k = 0; k < walk.frames.size(); ++k) {
    const KeyframePlaces places = walk.Until(k);
    EXPECT_TRUE((*map)->Wants(walk.frames[k].id, places));
    (*map)->Add(walk.frames[k], places);
  }
  while (worked && (*map)->Work()) {
  }
  return *std::move(map);
}

SurfaceMap& TheMap() {
  static const std::unique_ptr<SurfaceMap> map = MapOf(TheWalk());
  return *map;
}

std::vector<Eigen::Vector3f> Corners(const SurfaceMap& map) {
  std::vector<Eigen::Vector3f> corners;
  for (const auto& [index, chunk] : map.chunks()) {
    for (std::size_t i = 0; i < chunk->positions.size(); ++i) corners.push_back(chunk->Point(i));
  }
  return corners;
}

TEST(SurfaceMap, DepthsAreThoseOfTheRoom) {
  int known = 0, right = 0, bare = 0;
  for (const SurfaceMap::KeptView& view : TheMap().views()) {
    if (view.depth == nullptr) continue;
    const Eigen::Vector3f eye = view.world_from_camera.translation.cast<float>();
    for (int y = 0; y < view.depth->camera.height; ++y) {
      for (int x = 0; x < view.depth->camera.width; ++x) {
        const float inverse = view.depth->At(x, y);
        if (inverse <= 0.0f) continue;
        const Eigen::Vector3f ray =
            view.depth->camera.Ray(static_cast<float>(x), static_cast<float>(y));
        const float truth = Room::Look(eye, ray).first;
        ++known;
        right += std::abs(1.0f / inverse - truth) < 0.03f * truth ? 1 : 0;
        // A window reaches two pixels over the edge of what is bare.
        bare += Room::Bare(eye.y() + kWall_m * ray.y() + 0.06f) && truth == kWall_m ? 1 : 0;
      }
    }
  }
  ASSERT_GT(known, 5 * 160 * 120 / 2);
  EXPECT_GT(right, 0.95 * known);
  EXPECT_LT(bare, 0.01 * known);  // where nothing is known there is a hole
}

TEST(SurfaceMap, MeshLiesOnWhatWasSeenAndLeavesTheRestOpen) {
  const std::vector<Eigen::Vector3f> corners = Corners(TheMap());
  ASSERT_GT(corners.size(), 2000u);
  std::size_t right = 0, before = 0;
  for (const Eigen::Vector3f& corner : corners) {
    const bool wall = std::abs(corner.z() - kWall_m) < 0.03f * kWall_m;
    const bool box = std::abs(corner.z() - kBox_m) < 0.03f * kBox_m;
    right += wall || box ? 1 : 0;
    before += corner.z() < kBox_m - 0.1f ? 1 : 0;
    EXPECT_FALSE(wall && Room::Bare(corner.y() + 0.1f)) << corner.transpose();
  }
  EXPECT_GT(right, corners.size() * 9 / 10);
  EXPECT_EQ(before, 0u);
}

TEST(SurfaceMap, TrianglesFaceWhoSawThem) {
  std::size_t towards = 0, all = 0;
  for (const auto& [index, chunk] : TheMap().chunks()) {
    for (const auto& [a, b, c] : chunk->triangles) {
      const Eigen::Vector3f normal =
          (chunk->Point(b) - chunk->Point(a)).cross(chunk->Point(c) - chunk->Point(a));
      towards += normal.z() < 0.0f ? 1 : 0;
      ++all;
    }
  }
  ASSERT_GT(all, 2000u);
  EXPECT_GT(towards, all * 95 / 100);
}

TEST(SurfaceMap, NeighbouringChunksShareTheirBorder) {
  constexpr int kSide = 32;  // voxels of a chunk, which has one more on each side
  const int voxel = TheMap().chunks().begin()->second->span / (kSide + 2);  // steps
  std::map<std::array<std::int64_t, 3>, int> chunks_with;
  std::vector<std::array<std::int64_t, 3>> border;  // in the layer that is the neighbour's
  for (const auto& [index, chunk] : TheMap().chunks()) {
    for (const auto& at : chunk->positions) {
      std::array<std::int64_t, 3> place;
      for (int i = 0; i < 3; ++i) {
        place[i] = std::int64_t{index[i]} * kSide * voxel + at[i] - voxel;
      }
      ++chunks_with[place];
      if (std::min({at[0], at[1], at[2]}) < voxel) border.push_back(place);
    }
  }
  std::size_t shared = 0;
  for (const auto& place : border) shared += chunks_with.at(place) > 1 ? 1 : 0;
  ASSERT_GT(border.size(), 50u);
  EXPECT_GT(shared, border.size() * 8 / 10);  // the rest is the surface's own edge
}

TEST(SurfaceMap, SurfaceGoesWithItsKeyframes) {
  const auto map = MapOf(TheWalk());
  const std::uint64_t version = map->version();
  KeyframePlaces moved = TheWalk().places;
  for (KeyframePlace& place : moved.keyframes) place.world_from_camera.translation.x() += 0.5;
  map->SetPlaces(moved);
  while (map->Work()) {
  }
  EXPECT_GT(map->version(), version);
  float left = 10.0f, left_before = 10.0f;
  for (const Eigen::Vector3f& corner : Corners(*map)) left = std::min(left, corner.x());
  for (const Eigen::Vector3f& corner : Corners(TheMap())) {
    left_before = std::min(left_before, corner.x());
  }
  EXPECT_NEAR(left, left_before + 0.5f, 0.03f);  // and nothing of it stayed behind
}

TEST(SurfaceMap, AKeyframeThatTheMapDroppedGoesWithItsNeighbour) {
  const auto map = MapOf(TheWalk(), Options(), /*worked=*/false);
  KeyframePlaces thinned = TheWalk().places;
  thinned.keyframes.erase(thinned.keyframes.begin() + 4);
  map->SetPlaces(thinned);
  for (KeyframePlace& place : thinned.keyframes) place.world_from_camera.translation.y() += 0.25;
  map->SetPlaces(thinned);
  ASSERT_EQ(map->views().size(), 9u);
  EXPECT_NEAR(map->views()[4].world_from_camera.translation.y(), 0.25, 1e-9);
}

TEST(SurfaceMap, AnotherMapForgetsAll) {
  SurfaceOptions options = Options();
  options.max_keyframes = 7;
  const auto map = MapOf(TheWalk(), options);
  ASSERT_FALSE(map->chunks().empty());
  const std::uint64_t edition = map->edition(), version = map->version();
  KeyframePlaces other;
  other.generation = 2;
  map->SetPlaces(other);
  EXPECT_TRUE(map->chunks().empty());
  EXPECT_TRUE(map->views().empty());
  EXPECT_GT(map->edition(), edition);
  EXPECT_GE(map->version(), version);
}

TEST(SurfaceMap, MemoryIsBounded) {
  SurfaceOptions options = Options();
  options.max_blocks = 120;
  options.max_keyframes = 5;
  const auto map = MapOf(TheWalk(), options);
  EXPECT_LE(map->blocks(), 120u);
  EXPECT_LE(map->views().size(), 5u);
}

TEST(SurfaceOptions, NamesTheFieldAndWhatItMayBe) {
  SurfaceOptions options;
  options.voxel_m = 1.0;
  const auto map = SurfaceMap::Create(options);
  ASSERT_FALSE(map.ok());
  EXPECT_THAT(std::string(map.status().message()), HasSubstr("surfaces.voxel_m=1: give 0.002 to"));
}

TEST(SurfaceMapRestored, IsShownUntilAsMuchIsSeenAgainAndGoesWithItsMap) {
  SurfaceSnapshot before = MapOf(TheWalk())->Snapshot();
  ASSERT_GT(before.chunks.size(), 3u);
  // Something that is not there any more, where nobody looks.
  SurfaceChunk elsewhere = *before.chunks.begin()->second;
  elsewhere.index = {100, 100, 100};
  before.chunks[elsewhere.index] = std::make_shared<const SurfaceChunk>(elsewhere);
  before.generation = 1;

  auto map = SurfaceMap::Create(Options());
  ASSERT_TRUE(map.ok());
  const std::uint64_t edition = (*map)->Snapshot().edition;
  (*map)->Restore(before);
  const SurfaceSnapshot restored = (*map)->Snapshot();
  EXPECT_NE(restored.edition, edition);
  EXPECT_EQ(restored.chunks.size(), before.chunks.size());
  EXPECT_EQ(restored.voxel, before.voxel);

  const Walk& walk = TheWalk();
  for (std::size_t k = 0; k < walk.frames.size(); ++k) {
    (*map)->Add(walk.frames[k], walk.Until(k));
  }
  while ((*map)->Work()) {
  }
  const SurfaceSnapshot again = (*map)->Snapshot();
  EXPECT_GT(again.version, restored.version);
  EXPECT_TRUE(again.chunks.contains(elsewhere.index));
  int renewed = 0;
  for (const auto& [index, chunk] : again.chunks) renewed += chunk->version > restored.version;
  EXPECT_GT(renewed, 3);

  KeyframePlaces other = walk.places;
  other.generation = 2;
  other.keyframes.clear();
  (*map)->SetPlaces(other);
  EXPECT_TRUE((*map)->Snapshot().chunks.empty());
  EXPECT_NE((*map)->Snapshot().edition, again.edition);
}

}  // namespace
}  // namespace saccade::surface_map_test
