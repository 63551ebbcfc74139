#include "server/gateway/static_files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace saccade::static_files_test {
namespace {

class StaticFilesTest : public ::testing::Test {
 protected:
  StaticFilesTest() {
    std::string name = ::testing::TempDir() + "saccade_web_XXXXXX";
    root_ = mkdtemp(name.data());
  }
  ~StaticFilesTest() override { std::filesystem::remove_all(root_); }

  void Write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }

  std::filesystem::path root_;
};

TEST_F(StaticFilesTest, PagesAssetsAndTypes) {
  Write("index.html", "<p>expert");
  Write("wearer.html", "<p>wearer");
  Write("assets/main-1a2b.js", std::string(4000, 'x'));
  const auto files = StaticFiles::Load(root_);
  ASSERT_TRUE(files.ok());
  ASSERT_NE(files->Find("/"), nullptr);
  EXPECT_EQ(files->Find("/")->body, "<p>expert");
  EXPECT_EQ(files->Find("/?name=ada")->body, "<p>expert");
  EXPECT_EQ(files->Find("/")->cache_control, "no-cache");
  ASSERT_NE(files->Find("/wearer"), nullptr);
  EXPECT_EQ(files->Find("/wearer")->body, "<p>wearer");
  const StaticFile* script = files->Find("/assets/main-1a2b.js");
  ASSERT_NE(script, nullptr);
  EXPECT_EQ(script->content_type, "text/javascript; charset=utf-8");
  EXPECT_NE(script->cache_control.find("immutable"), std::string::npos);
  EXPECT_LT(script->gzip_body.size(), 200U);
  EXPECT_FALSE(script->gzip_body.empty());
}

TEST_F(StaticFilesTest, NothingOutsideTheRootIsReachable) {
  Write("index.html", "<p>expert");
  std::filesystem::create_symlink("/etc/passwd", root_ / "passwd.txt");
  const auto files = StaticFiles::Load(root_);
  ASSERT_TRUE(files.ok());
  for (const char* path : {"/../index.html", "/..%2findex.html", "/assets/../index.html",
                           "//etc/passwd", "/passwd.txt", "/etc/passwd", "", "index.html", "/."}) {
    EXPECT_EQ(files->Find(path), nullptr) << path;
  }
}

TEST_F(StaticFilesTest, AbsentPageSaysHowToBuildIt) {
  const auto files = StaticFiles::Load(root_ / "nowhere");
  ASSERT_TRUE(files.ok());
  ASSERT_NE(files->Find("/"), nullptr);
  EXPECT_NE(files->Find("/")->body.find("npm run build"), std::string::npos);
}

}  // namespace
}  // namespace saccade::static_files_test
