#include "shared/io/option_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace saccade::option_table_test {
namespace {

using ::testing::HasSubstr;

struct Options {
  double angle_rad = 0.5;
  int count = 3;
  std::uint64_t seed = 18'000'000'000'000'000'000u;
  bool on = true;
  Eigen::Vector3d axis{0, 1, 0};

  absl::Status Validate() const;
};

const OptionTable<Options>& Table() {
  static const OptionTable<Options> table = {
      {"angle_mrad", &Options::angle_rad, 0, 1000, "how far", 1e-3},
      {"count", &Options::count, 1, 9, "how many"},
      {"seed", &Options::seed, 0, 1.8e19, "chance"},
      {"on", &Options::on, 0, 1, "whether"},
      {"axis", &Options::axis, 0, 0, "where to"},
  };
  return table;
}

absl::Status Options::Validate() const { return Table().Validate(*this, "thing."); }

absl::Status Load(const std::string& text, Options& options) {
  const std::filesystem::path file = ::testing::TempDir() + "option_table_test.toml";
  std::ofstream(file) << text;
  return LoadTomlTable(
      file, "thing", [](TomlTable& table, Options& out) { Table().Read(table, out); }, options);
}

TEST(OptionTable, ReadsFilesAndSetsInTheUnitThatAPersonWrites) {
  Options options;
  ASSERT_TRUE(
      Load("[thing]\nangle_mrad = 250\ncount = 4\non = false\naxis = [1, 0, 0]\n", options).ok());
  EXPECT_DOUBLE_EQ(options.angle_rad, 0.25);
  EXPECT_EQ(options.count, 4);
  EXPECT_FALSE(options.on);
  EXPECT_EQ(options.axis.x(), 1);
  ASSERT_TRUE(Table().Set("angle_mrad", "125", "thing.", options).ok());
  EXPECT_DOUBLE_EQ(options.angle_rad, 0.125);
  ASSERT_TRUE(Table().Set("on", "true", "thing.", options).ok());
  EXPECT_TRUE(options.on);
}

TEST(OptionTable, OneRangeServesFileAndSet) {
  Options options;
  const std::string words = "thing.angle_mrad: 1500; give a number from 0 to 1000";
  EXPECT_THAT(std::string(Load("[thing]\nangle_mrad = 1500\n", options).message()),
              HasSubstr(words));
  EXPECT_EQ(std::string(Table().Set("angle_mrad", "1500", "thing.", options).message()), words);
  EXPECT_EQ(std::string(Table().Set("count", "3.5", "thing.", options).message()),
            "thing.count: '3.5' is not a value of its type");
  EXPECT_EQ(Table().Set("cuont", "3", "thing.", options).code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(Load("[thing]\ncuont = 3\n", options).message()),
              HasSubstr("thing.cuont: unknown key; known: angle_mrad, count, seed, on, axis"));
  EXPECT_EQ(options.angle_rad, 0.5) << "what was refused changed something";
}

TEST(OptionTable, WhatDescribesItIsAFileThatChangesNothing) {
  Options changed{.angle_rad = 0.1, .count = 9, .seed = 1, .on = false, .axis = {0, 0, 1}};
  const std::string text = Table().Describe(Options());
  EXPECT_THAT(text, HasSubstr("angle_mrad = 500.0"));
  EXPECT_THAT(text, HasSubstr("# 1 to 9: how many"));
  // A seed beyond what TOML's integers hold is not one that a file can name.
  changed.seed = 7;
  ASSERT_TRUE(Load("[thing]\n" + Table().Describe(Options{.seed = 7}), changed).ok());
  EXPECT_EQ(Table().ToToml(changed), Table().ToToml(Options{.seed = 7}));
}

}  // namespace
}  // namespace saccade::option_table_test
