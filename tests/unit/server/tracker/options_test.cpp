#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "server/tracker/tracker_options.hpp"

namespace saccade::options_test {
namespace {

using ::testing::HasSubstr;

TEST(TrackerOptions, DefaultsAreValid) { EXPECT_TRUE(TrackerOptions().Validate().ok()); }

TEST(TrackerOptions, SetChangesTheNamedFieldOnly) {
  TrackerOptions options;
  ASSERT_TRUE(options.Set("seed", "7").ok());
  ASSERT_TRUE(options.Set("pixel_sigma_px", "0.8").ok());
  ASSERT_TRUE(options.Set("fej", "false").ok());
  EXPECT_EQ(options.seed, 7U);
  EXPECT_EQ(options.pixel_sigma_px, 0.8);
  EXPECT_FALSE(options.fej);
  EXPECT_EQ(options.first_stage, TrackerOptions().first_stage);
}

TEST(TrackerOptions, WrongKeysAndValuesAreNamedAndChangeNothing) {
  TrackerOptions options;
  const absl::Status unknown = options.Set("no_such", "1");
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("seed"));  // lists what there is
  EXPECT_FALSE(options.Set("seed", "many").ok());
  EXPECT_FALSE(options.Set("max_nssd", "nan").ok());
  const absl::Status range = options.Set("max_features", "100000");
  EXPECT_THAT(std::string(range.message()), HasSubstr("400"));
  EXPECT_EQ(options.max_features, TrackerOptions().max_features);
}

TEST(TrackerOptions, TomlFileIsReadAndItsErrorsNameFileAndKey) {
  const std::string path = ::testing::TempDir() + "/tracker_options.toml";
  std::ofstream(path) << "[server]\nx = 1\n[tracker]\nseed = 9\nfej = false\ngate_sigma = 2.5\n";
  TrackerOptions options;
  ASSERT_TRUE(options.LoadToml(path).ok());
  EXPECT_EQ(options.seed, 9U);
  EXPECT_EQ(options.gate_sigma, 2.5);
  std::ofstream(path) << "[tracker]\nsead = 9\n";
  const absl::Status wrong = options.LoadToml(path);
  EXPECT_THAT(std::string(wrong.message()), HasSubstr("sead"));
  EXPECT_THAT(std::string(wrong.message()), HasSubstr(path));
  std::ofstream(path) << "[tracker\n";
  EXPECT_EQ(options.LoadToml(path).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(options.LoadToml(path + ".absent").code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace saccade::options_test
