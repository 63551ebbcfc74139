#include "tests/lint/link_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "tests/lint/include_rules.hpp"

namespace saccade::lint::link_rules_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const fs::path kRoot = SACCADE_SOURCE_DIR;

std::string ReadText(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(LinkLines, WhatATargetIncludesItNames) {
  const auto targets = ReadTree(kRoot);
  EXPECT_GE(targets.size(), 25U);  // a check that reads nothing passes always
  for (const std::string& problem : MissingLinks(kRoot, targets)) ADD_FAILURE() << problem;
}

// A tree of two folders, once with the link line and once without.
class PlantedTree : public ::testing::Test {
 protected:
  PlantedTree() {
    Write("server/a/a.hpp", "#pragma once\n");
    Write("server/a/a.cpp", "#include \"server/a/a.hpp\"\n");
    Write("server/a/CMakeLists.txt", "saccade_library(saccade_server_a SOURCES a.cpp)\n");
    Write("server/b/b.hpp", "#include \"server/a/a.hpp\"\n");
    Write("server/b/b.cpp", "#include \"server/b/b.hpp\"\n");
  }
  ~PlantedTree() override { fs::remove_all(root_); }

  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  std::vector<std::string> Missing(const std::string& links) const {
    Write("server/b/CMakeLists.txt",
          "# saccade_server_a in a comment is no link\nsaccade_library(saccade_server_b\n  SOURCES "
          "b.cpp\n  " +
              links + "\n  PCH eigen)\n");
    return MissingLinks(root_, ReadTree(root_));
  }
  const fs::path root_ =
      fs::path(::testing::TempDir()) / ("link_rules_test_" + std::to_string(getpid()));
};

TEST_F(PlantedTree, AMissingLinkIsCaughtAndNamed) {
  const std::vector<std::string> missing = Missing("PUBLIC absl::status");
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_THAT(missing.front(), HasSubstr("server/b/b.hpp includes server/a/a.hpp"));
  EXPECT_THAT(missing.front(), HasSubstr("server/b/CMakeLists.txt"));
  EXPECT_THAT(missing.front(), HasSubstr("add saccade_server_a"));
  EXPECT_THAT(Missing("PUBLIC absl::status PRIVATE saccade_server_a"), IsEmpty());
}

// The lists of CMake and of the include rules name the folders that there are, and no others.
TEST(FolderLists, NameTheFoldersThatThereAre) {
  for (const char* side :
       {"server", "client", "shared", "tests", "tests/unit", "tests/integration"}) {
    const std::vector<std::string> listed =
        FoldersListed(ReadText(kRoot / side / "CMakeLists.txt"));
    EXPECT_FALSE(listed.empty()) << side;
    for (const std::string& name : listed) {
      EXPECT_TRUE(fs::exists(kRoot / side / name / "CMakeLists.txt")) << side << "/" << name;
    }
    if (side == std::string_view("tests/unit")) continue;  // it names folders of folders
    for (const auto& entry : fs::directory_iterator(kRoot / side)) {
      if (!fs::exists(entry.path() / "CMakeLists.txt")) continue;
      const std::string name = entry.path().filename().string();
      EXPECT_NE(std::find(listed.begin(), listed.end(), name), listed.end())
          << side << "/CMakeLists.txt leaves out " << name;
    }
  }
  for (const std::string& folder : FoldersOfTheRules()) {
    EXPECT_TRUE(fs::is_directory(kRoot / folder)) << "include_rules.cpp: " << folder;
  }
  EXPECT_THAT(FoldersListed("# none\nforeach(folder a\n  b)\n"), ElementsAre("a", "b"));
}

// One helper ends every unary call: nobody else touches its reactor (server/rpc/unary_call.hpp).
TEST(UnaryCalls, GoThroughOneHelper) {
  int services = 0;
  for (const auto& entry : fs::directory_iterator(kRoot / "server/rpc")) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with("_service.cpp")) continue;
    ++services;
    const std::string text = ReadText(entry.path());
    EXPECT_THAT(text, HasSubstr("UnaryCall call(")) << name;
    EXPECT_THAT(text, ::testing::Not(HasSubstr("DefaultReactor"))) << name;
    EXPECT_THAT(text, ::testing::Not(HasSubstr("reactor->Finish"))) << name;
  }
  EXPECT_GE(services, 4);
}

}  // namespace
}  // namespace saccade::lint::link_rules_test
