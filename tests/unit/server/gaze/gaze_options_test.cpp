#include "server/gaze/gaze_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace saccade::gaze_options_test {
namespace {

using ::testing::HasSubstr;

absl::Status Load(const std::string& text, GazeOptions& options) {
  const std::filesystem::path file = ::testing::TempDir() + "gaze_options_test.toml";
  std::ofstream(file) << text;
  return options.LoadToml(file);
}

TEST(GazeOptions, ReadsItsTableAndLeavesTheRest) {
  GazeOptions options;
  ASSERT_TRUE(options.Validate().ok());
  ASSERT_TRUE(Load("[gaze]\nrate_deg_s = 20\ncompensate_latency = false\n[video]\n", options).ok());
  EXPECT_EQ(options.rate_deg_s, 20.0);
  EXPECT_FALSE(options.compensate_latency);
  EXPECT_EQ(options.arrived_s, 0.2);
}

TEST(GazeOptions, ErrorsNameFileKeyAndRemedy) {
  for (const auto& [text, words] : {std::pair("[gaze]\nspeed = 3\n", "gaze.speed: unknown key"),
                                    std::pair("[gaze]\nrate_deg_s = -1\n", "gaze.rate_deg_s"),
                                    std::pair("[gaze]\nrate_deg_s = nan\n", "give a number"),
                                    std::pair("[gaze]\nexplore_when_idle = 1\n", "true or false"),
                                    std::pair("gaze = 1\n", "not a table")}) {
    GazeOptions options;
    const absl::Status status = Load(text, options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(words));
    EXPECT_THAT(std::string(status.message()), HasSubstr("gaze_options_test.toml"));
    EXPECT_TRUE(options.Validate().ok());
  }
}

}  // namespace
}  // namespace saccade::gaze_options_test
