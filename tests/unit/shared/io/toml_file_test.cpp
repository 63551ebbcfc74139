#include "shared/io/toml_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace saccade::toml_file_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Times(int count, const std::string& text) {
  std::string out;
  for (int i = 0; i < count; ++i) out += text;
  return out;
}

absl::StatusOr<toml::value> Parse(const std::string& text) {
  const std::string file =
      ::testing::TempDir() + "/saccade_toml_file_test_" + std::to_string(getpid()) + ".toml";
  std::ofstream(file, std::ios::binary) << text;
  return ParseTomlFile(file);
}

TEST(TomlFile, IsParsed) {
  const absl::StatusOr<toml::value> root = Parse("a = 1\n[b]\nc = [[1.5], [2.5]]\n");
  ASSERT_TRUE(root.ok()) << root.status();
  EXPECT_EQ(toml::find<int>(*root, "a"), 1);
  EXPECT_THAT(Parse("a = = 1").status().message(), HasSubstr("saccade_toml_file_test_"));
}

// Each ended the process (toml11 recurses) before nesting was looked at.
TEST(TomlFile, DeepNestingIsRefusedInWords) {
  const int n = 100'000;
  for (const std::string& text :
       {"a = " + Times(n, "["), "a = " + Times(n, "[") + Times(n, "]"), "a = " + Times(n, "{b="),
        "a = " + Times(n, "{b = ["), Times(n, "["), "a" + Times(n, ".a") + " = 1",
        "[a" + Times(n, ".a") + "]\n", "[[a" + Times(n, " . \"a\"") + "]]\n",
        "a = [ # ]\n" + Times(n, "[ # ]\n"), "a = [ \"]\",\n" + Times(n, "[ ']',\n"),
        "x = '''\n'''''\na = " + Times(n, "["), "x = \"\"\"\\\"\"\"\"\na = " + Times(n, "[")}) {
    const absl::Status status = Parse(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text.substr(0, 40);
    EXPECT_THAT(status.message(), HasSubstr("saccade_toml_file_test_")) << text.substr(0, 40);
  }
  EXPECT_THAT(CheckTomlDepth("x = 1\na = " + Times(n, "[")).message(),
              AllOf(HasSubstr("line 2"), HasSubstr("64")));
}

TEST(TomlFile, WhatOnlyLooksNestedIsNot) {
  const std::string brackets = Times(200, "[{.");
  for (const std::string& text :
       {"a = \"" + brackets + "\"", "a = '" + brackets + "'", "a = 1 # " + brackets,
        "a = \"\"\"\n" + brackets + "\n\"\"\"", "a = '''\n" + brackets + "''''\nb = 1",
        "a = \"\\\"" + brackets + "\"", "a = [" + Times(200, "1.5, ") + "]",
        Times(1000, "[[a]]\nb.c = [[1.5]]\n"), "a = " + Times(60, "[") + Times(60, "]")}) {
    EXPECT_TRUE(Parse(text).ok()) << text.substr(0, 40) << Parse(text).status();
  }
}

TEST(TomlFile, AFolderAndALongFileAreNamed) {
  EXPECT_THAT(ParseTomlFile("/tmp").status().message(),
              AllOf(HasSubstr("/tmp: is a folder"), HasSubstr("a TOML file")));
  EXPECT_THAT(ParseTomlFile("/dev/zero").status().message(), HasSubstr("is a device"));
  EXPECT_THAT(Parse(std::string(2'000'000, ' ')).status().message(), HasSubstr("too long"));
}

}  // namespace
}  // namespace saccade::toml_file_test
