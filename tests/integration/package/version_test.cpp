#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "tests/integration/support/process.hpp"

namespace saccade::testing::version_test {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

TEST(Version, EveryProgramSaysTheSameVersionAndCommit) {
  std::set<std::string> said;
  for (const std::string program :
       {"saccade", "saccade-server", "saccade-eval", "saccade-decode", "saccade-client"}) {
    const RunResult run = RunProgram({SACCADE_BIN "/" + program, "--version"});
    EXPECT_EQ(run.exit_code, 0) << program << run.err;
    ASSERT_EQ(run.out.rfind(program + " ", 0), 0U) << run.out;
    said.insert(run.out.substr(program.size() + 1));
  }
  ASSERT_EQ(said.size(), 1U) << ::testing::PrintToString(said);
  EXPECT_THAT(*said.begin(), HasSubstr(SACCADE_VERSION " ("));
  EXPECT_THAT(*said.begin(),
              MatchesRegex("[0-9.]+ \\(([0-9a-f]{7,}(\\+dirty)?|commit unknown)\\)\n"));
}

/// A source tree with what the script asks for, and nothing else.
class Commit : public ::testing::Test {
 protected:
  Commit() {
    std::filesystem::create_directories(source_ / "deploy/cmake");
    Write("deploy/cmake/commit.txt", "$Format:%h$\n");
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(source_ / name) << text;
  }
  std::string Git(std::vector<std::string> words) const {
    words.insert(words.begin(), {"/usr/bin/git", "-c", "user.name=a", "-c", "user.email=a@b.c",
                                 "-C", source_.string()});
    const RunResult run = RunProgram(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.out;
  }
  std::string Written() const {
    const RunResult run =
        RunProgram({SACCADE_CMAKE, "-DSOURCE=" + source_.string(), "-DOUT=" + header_.string(),
                    "-P", SACCADE_SOURCE_DIR "/deploy/cmake/write_commit.cmake"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::ifstream in(header_);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  TemporaryFolder folder_;
  const std::filesystem::path source_ = folder_ / "source", header_ = folder_ / "commit.hpp";
};

TEST_F(Commit, OfATreeWithoutGitIsUnknown) {
  EXPECT_EQ(Written(), "#define SACCADE_COMMIT \"commit unknown\"\n");
}

TEST_F(Commit, OfAnArchiveIsWhatGitArchiveWroteIntoIt) {
  Write("deploy/cmake/commit.txt", "76d4111a2\n");
  EXPECT_EQ(Written(), "#define SACCADE_COMMIT \"76d4111a2\"\n");
}

TEST_F(Commit, OfARepositorySaysWhetherFilesDiffer) {
  if (!std::filesystem::exists("/usr/bin/git")) GTEST_SKIP() << "no git here";
  Git({"init", "-q"});
  Git({"add", "."});
  Git({"commit", "-qm", "first"});
  const std::string hash = Git({"rev-parse", "--short=9", "HEAD"}).substr(0, 9);
  EXPECT_EQ(Written(), "#define SACCADE_COMMIT \"" + hash + "\"\n");
  Write("deploy/cmake/commit.txt", "changed\n");
  EXPECT_EQ(Written(), "#define SACCADE_COMMIT \"" + hash + "+dirty\"\n");
}

// Else every build would compile and link anew.
TEST_F(Commit, HeaderIsLeftAloneWhileTheCommitIsTheSame) {
  Written();
  const auto long_ago = std::filesystem::last_write_time(header_) - std::chrono::hours(1);
  std::filesystem::last_write_time(header_, long_ago);
  Written();
  EXPECT_EQ(std::filesystem::last_write_time(header_), long_ago);
}

}  // namespace
}  // namespace saccade::testing::version_test
