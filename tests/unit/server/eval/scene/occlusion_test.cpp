#include "server/eval/scene/occlusion.hpp"

#include <gtest/gtest.h>

namespace saccade::occlusion_test {
namespace {

TEST(Occlusion, WhatIsSeenAndWhatIsHiddenIsThatOfCastRays) {
  const std::filesystem::path out = std::filesystem::path(::testing::TempDir()) / "occlusion_test";
  const absl::StatusOr<OcclusionSummary> summary = RunOcclusion(5, 12, out);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_GE(summary->partly_hidden, 4);
  EXPECT_GT(summary->hidden.either, 20'000);
  EXPECT_GE(summary->seen.Iou(), 0.99);
  EXPECT_GE(summary->hidden.Iou(), 0.98);  // small strips: their edges weigh more
  EXPECT_TRUE(std::filesystem::exists(out / "report.json"));
}

}  // namespace
}  // namespace saccade::occlusion_test
