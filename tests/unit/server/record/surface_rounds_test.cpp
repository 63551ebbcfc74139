#include "server/record/surface_rounds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/record/replayed_state.hpp"

namespace saccade::surface_rounds_test {
namespace {

constexpr Timestamp kSecond = 1'000'000'000;

std::shared_ptr<const SurfaceChunk> Chunk(int x, std::uint64_t version, int corners = 3) {
  SurfaceChunk chunk;
  chunk.index = {x, 0, 0};
  chunk.version = version;
  chunk.step_m = 0.001f;
  for (int k = 0; k < corners; ++k) {
    chunk.positions.push_back({static_cast<std::uint16_t>(100 * k),
                               static_cast<std::uint16_t>(k % 2 * 100 + version), 0});
    chunk.colors_rgb.push_back({10, 20, 30});
  }
  if (corners >= 3) chunk.triangles.push_back({0, 1, 2});
  return std::make_shared<const SurfaceChunk>(chunk);
}

SurfaceSnapshot Three() {
  SurfaceSnapshot surface;
  surface.edition = 5;
  surface.version = 3;
  for (int x = 0; x < 3; ++x)
    surface.chunks[{x, 0, 0}] = Chunk(x, static_cast<std::uint64_t>(x + 1));
  return surface;
}

TEST(SurfaceRounds, EverythingThenWhatIsNewThenEverythingAgain) {
  SurfaceRounds rounds;
  SurfaceSnapshot surface = Three();
  auto due = rounds.Due(surface, kSecond);
  ASSERT_TRUE(due);
  EXPECT_EQ(due->chunks_size(), 3);
  EXPECT_FALSE(rounds.Due(surface, 3 * kSecond));
  surface.chunks[{1, 0, 0}] = Chunk(1, ++surface.version);
  due = rounds.Due(surface, 5 * kSecond);
  ASSERT_TRUE(due);
  ASSERT_EQ(due->chunks_size(), 1);
  EXPECT_EQ(due->chunks(0).x(), 1);
  EXPECT_EQ(due->version(), surface.version);
  due = rounds.Due(surface, 11 * kSecond);  // the one written later is not due yet
  ASSERT_TRUE(due);
  EXPECT_EQ(due->chunks_size(), 2);
  surface.edition = 6;
  due = rounds.Due(surface, 11 * kSecond + 1);
  ASSERT_TRUE(due);
  EXPECT_EQ(due->chunks_size(), 3);
}

absl::Status TakeInto(ReplayedState& state, const v1::GetSurfaceResponse& due) {
  const std::string data = due.SerializeAsString();
  return state.Take({"/saccade/surface", kSecond, data}, nullptr);
}

TEST(ReplayedSurface, IsWhatWasRecordedAndToldAgainChangesNothing) {
  SurfaceRounds rounds;
  SurfaceSnapshot surface = Three();
  ReplayedState state;
  state.Restart();
  ASSERT_TRUE(TakeInto(state, *rounds.Due(surface, kSecond)).ok());
  const auto first = state.surface();
  ASSERT_EQ(first->chunks.size(), 3u);
  EXPECT_EQ(first->chunks.at({2, 0, 0})->positions, surface.chunks.at({2, 0, 0})->positions);
  EXPECT_EQ(first->version, 3u);

  ASSERT_TRUE(TakeInto(state, *rounds.Due(surface, 20 * kSecond)).ok());
  EXPECT_EQ(state.surface()->version, first->version);
  EXPECT_EQ(state.surface()->edition, first->edition);

  surface.chunks[{0, 0, 0}] = Chunk(0, ++surface.version, 0);  // it is gone
  ASSERT_TRUE(TakeInto(state, *rounds.Due(surface, 22 * kSecond)).ok());
  EXPECT_TRUE(state.surface()->chunks.at({0, 0, 0})->triangles.empty());
  EXPECT_GT(state.surface()->version, first->version);

  state.Restart();  // another moment: nothing of before
  EXPECT_TRUE(state.surface()->chunks.empty());
  EXPECT_NE(state.surface()->edition, first->edition);

  v1::GetSurfaceResponse damaged = *rounds.Due(surface, 40 * kSecond);
  for (v1::SurfaceChunk& chunk : *damaged.mutable_chunks()) chunk.mutable_corners()->resize(2);
  EXPECT_EQ(TakeInto(state, damaged).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace saccade::surface_rounds_test
