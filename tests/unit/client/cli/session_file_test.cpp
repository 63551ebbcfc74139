#include "client/cli/session_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace saccade::cli::session_file_test {
namespace {

namespace fs = std::filesystem;

const std::string kAnn = "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";
const std::string kBob = "7a1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d22";

class SessionFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "saccade-session-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    setenv("XDG_STATE_HOME", folder_.c_str(), 1);
    umask(0);  // the file has to be private by itself
  }
  void TearDown() override {
    umask(022);
    fs::remove_all(folder_);
  }
  static unsigned Mode(const std::string& path) {
    struct stat facts {};
    EXPECT_EQ(lstat(path.c_str(), &facts), 0) << path;
    return facts.st_mode & 0777;
  }
  fs::path folder_;
};

TEST_F(SessionFile, BelongsToServerAndName) {
  SaveSession("127.0.0.1:50051", "Ann", kAnn);
  SaveSession("127.0.0.1:50051", "Bob", kBob);
  EXPECT_EQ(LoadSession("127.0.0.1:50051", "Ann"), kAnn);
  EXPECT_EQ(LoadSession("127.0.0.1:50051", "Bob"), kBob);
  EXPECT_EQ(LoadSession("127.0.0.1:50052", "Ann"), "");
  EXPECT_EQ(LoadSession("127.0.0.1:50051", "Eve"), "");
  // Alike once only letters and digits are left.
  EXPECT_NE(SessionFilePath("a.b:1", "Ann B"), SessionFilePath("a_b:1", "Ann_B"));
  EXPECT_NE(SessionFilePath("s:1", "Änn"), SessionFilePath("s:1", "Önn"));
}

TEST_F(SessionFile, IsForItsUserAlone) {
  SaveSession("s:1", "Ann", kAnn);
  const std::string path = SessionFilePath("s:1", "Ann");
  EXPECT_EQ(Mode(path), 0600u);
  EXPECT_EQ(Mode(fs::path(path).parent_path()), 0700u);
  chmod(path.c_str(), 0644);
  EXPECT_EQ(LoadSession("s:1", "Ann"), "") << "who knows who has read it";
  SaveSession("s:1", "Ann", kBob);
  EXPECT_EQ(Mode(path), 0600u);
  EXPECT_EQ(LoadSession("s:1", "Ann"), kBob);
}

TEST_F(SessionFile, NeitherLinksNorPipesNorHalvesAreRead) {
  SaveSession("s:1", "Ann", kAnn);
  const std::string path = SessionFilePath("s:1", "Ann");
  fs::rename(path, path + ".away");
  fs::create_symlink(path + ".away", path);
  EXPECT_EQ(LoadSession("s:1", "Ann"), "");
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(LoadSession("s:1", "Ann"), "") << "and does not wait for a writer";
  fs::remove(path);
  std::ofstream(path) << "6f1c";
  chmod(path.c_str(), 0600);
  EXPECT_EQ(LoadSession("s:1", "Ann"), "");
}

TEST_F(SessionFile, APersonsKeyIsMadeOnceForServerAndNameAndForItsUserAlone) {
  const std::string key = PersonKey("s:1", "Ann");
  EXPECT_EQ(key.size(), 43u);
  EXPECT_EQ(
      key.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"),
      key.npos);
  EXPECT_EQ(PersonKey("s:1", "Ann"), key);
  EXPECT_NE(PersonKey("s:1", "Bob"), key);
  EXPECT_NE(PersonKey("s:2", "Ann"), key) << "no server is told another's";
  const std::string path = PersonFilePath("s:1", "Ann");
  EXPECT_EQ(Mode(path), 0600u);
  chmod(path.c_str(), 0640);
  const std::string anew = PersonKey("s:1", "Ann");
  EXPECT_NE(anew, key) << "who knows who has read it";
  EXPECT_EQ(Mode(path), 0600u);
  unsetenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const std::string kept = home != nullptr ? home : "";
  unsetenv("HOME");
  EXPECT_EQ(PersonKey("s:1", "Ann"), "");
  if (!kept.empty()) setenv("HOME", kept.c_str(), 1);
}

}  // namespace
}  // namespace saccade::cli::session_file_test
