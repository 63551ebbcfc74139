// Few pictures a second, on a recording: as good as at 30 where it can be followed, and said where
// it cannot.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "server/capture/dataset.hpp"
#include "server/eval/altered_source.hpp"
#include "server/eval/run.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::low_rate_test {
namespace {

const std::filesystem::path kData = std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data";

struct Outcome {
  nlohmann::ordered_json report;
  std::set<std::string> advice;  // all that was given
  std::string last_advice;       // in the last frame that was not tracked
  int untracked_without_advice = 0;
  int initialising = 0, orientation_only = 0;
};

/// The first `frames` of a recording, of these every Nth.
Outcome Follow(const std::string& name, std::uint64_t frames, std::uint64_t every,
               std::uint64_t seed) {
  Outcome outcome;
  SourceOptions range;
  range.end_frame = frames;
  auto opened = OpenDataset(kData / name, range);
  EXPECT_TRUE(opened.ok()) << opened.status();
  if (!opened.ok()) return outcome;
  Alterations alterations;
  alterations.every = every;
  const auto source = Altered(*std::move(opened), alterations);
  const auto truth = LoadTrajectory(kData / name / "groundtruth.txt");
  EXPECT_TRUE(truth.ok()) << truth.status();
  TrackerOptions options;
  options.seed = seed;
  const auto tracker = Tracker::Create(source->info(), options);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  if (!truth.ok() || !tracker.ok()) return outcome;
  const auto track = [&](const Frame& frame) {
    auto snapshot = (*tracker)->Track(frame);
    if (!snapshot->advice.empty()) outcome.advice.insert(snapshot->advice);
    if (snapshot->status != TrackingStatus::kTracking) {
      outcome.untracked_without_advice += snapshot->advice.empty() ? 1 : 0;
      outcome.last_advice = snapshot->advice;
    }
    if (snapshot->status == TrackingStatus::kInitialising) {
      ++outcome.initialising;
      outcome.orientation_only +=
          snapshot->advice.find("orientation only") != std::string::npos ? 1 : 0;
    }
    return snapshot;
  };
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / ("low_rate_" + std::to_string(getpid()));
  const auto report = RunTracker(*source, track, *truth, folder);
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(report.ok()) << report.status();
  if (report.ok()) outcome.report = *report;
  return outcome;
}

bool IsHere(const char* name) { return std::filesystem::exists(kData / name); }

// Rows and births carried by velocities one and a half steps old: lost after 6 s at 15 pictures a
// second, and the map deformed by 40 %.
TEST(LowRate, FifteenPicturesASecondAreAsGoodAsThirty) {
  if (!IsHere("tum_fr1_xyz")) GTEST_SKIP() << "tum_fr1_xyz is not in ../shared/data";
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Outcome outcome = Follow("tum_fr1_xyz", 300, 2, seed);
    ASSERT_FALSE(outcome.report.empty());
    std::printf("seed %d: %s\n", static_cast<int>(seed), outcome.report.dump().c_str());
    EXPECT_GE(outcome.report["tracked_frames"], 140) << "of 150";
    EXPECT_EQ(outcome.report["false_tracked_frames"], 0);
    EXPECT_LT(outcome.report["ate_sim3_m"], 0.012);
  }
}

TEST(LowRate, WhereItIsTooLowTheAdviceSaysSo) {
  if (!IsHere("tum_fr1_xyz")) GTEST_SKIP() << "tum_fr1_xyz is not in ../shared/data";
  const Outcome outcome = Follow("tum_fr1_xyz", 500, 10, 1);
  ASSERT_FALSE(outcome.report.empty());
  const auto& wrong = outcome.report["false_tracked_frames"];
  EXPECT_TRUE(wrong.is_null() || wrong == 0) << "null: nothing was tracked";
  EXPECT_EQ(outcome.untracked_without_advice, 0);
  EXPECT_NE(outcome.last_advice.find("3 pictures a second are too few for this motion"),
            std::string::npos)
      << outcome.last_advice;
}

TEST(LowRate, ThirtyAreNeverTooFew) {
  if (!IsHere("tum_fr1_rpy")) GTEST_SKIP() << "tum_fr1_rpy is not in ../shared/data";
  const Outcome outcome = Follow("tum_fr1_rpy", 200, 1, 1);
  for (const std::string& advice : outcome.advice) {
    EXPECT_EQ(advice.find("too few"), std::string::npos) << advice;
  }
}

// Its first seconds turn and hardly move.
TEST(LowRate, ATurningCameraIsToldThatOnlyItsOrientationIsKnown) {
  if (!IsHere("tum_fr1_rpy")) GTEST_SKIP() << "tum_fr1_rpy is not in ../shared/data";
  const Outcome outcome = Follow("tum_fr1_rpy", 40, 1, 1);
  ASSERT_GT(outcome.initialising, 10);
  EXPECT_GE(outcome.orientation_only, outcome.initialising - 2);
}

}  // namespace
}  // namespace saccade::low_rate_test
