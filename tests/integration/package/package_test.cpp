#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "tests/integration/support/process.hpp"

namespace saccade::testing::package_test {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;

std::vector<std::string> Lines(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The tree as the package has it.
class Installed : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    const RunResult run =
        RunProgram({SACCADE_CMAKE, "--install", SACCADE_BUILD_FOLDER, "--prefix", "/usr"},
                   std::chrono::seconds(60), {"DESTDIR=" + folder_->path()});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static fs::path At(const std::string& path) { return folder_->path() + path; }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> Installed::folder_;

TEST_F(Installed, HoldsProgramsServiceConfigurationLicenceAndExamples) {
  for (const char* file : {"/usr/bin/saccade", "/usr/bin/saccade-server", "/usr/bin/saccade-eval",
                           "/usr/bin/saccade-decode", "/usr/bin/saccade-client",
                           "/usr/share/applications/saccade-client.desktop",
                           "/usr/share/icons/hicolor/scalable/apps/saccade.svg",
                           "/usr/lib/systemd/system/saccade.service", "/etc/saccade/saccade.toml",
                           "/usr/share/doc/saccade/copyright", "/usr/share/doc/saccade/install.md",
                           "/usr/share/doc/saccade/examples/python/place_mark.py"}) {
    EXPECT_TRUE(fs::is_regular_file(At(file))) << file;
  }
}

TEST_F(Installed, HoldsThePageWhereTheServerLooksForIt) {
  if (!fs::exists(SACCADE_SOURCE_DIR "/web/dist")) GTEST_SKIP() << "the page is not built";
  EXPECT_TRUE(fs::is_regular_file(At("/usr/share/saccade/web/index.html")));
}

TEST_F(Installed, HoldsNothingElseBesides) {
  for (const auto& entry : fs::recursive_directory_iterator(folder_->path())) {
    if (!entry.is_regular_file()) continue;
    const std::string path = entry.path().string().substr(folder_->path().size());
    EXPECT_TRUE(std::regex_search(
        path,
        std::regex("^(/usr/bin/saccade(-server|-eval|-decode|-client)?|/usr/lib/systemd/"
                   "system/saccade.service|"
                   "/etc/saccade/saccade.toml|/usr/share/(saccade/(web|models)|doc/saccade)/.*|"
                   "/usr/share/applications/saccade-client.desktop|"
                   "/usr/share/icons/hicolor/scalable/apps/saccade.svg|"
                   "/usr/share/man/man[18]/saccade.*)$")))
        << path;
  }
}

// The unit and the package's scripts name files: a renamed one fails here, not at a customer's.
TEST_F(Installed, ServiceStartsWhatIsThere) {
  const std::vector<std::string> unit = Lines(At("/usr/lib/systemd/system/saccade.service"));
  EXPECT_THAT(unit,
              Contains("ExecStart=/usr/bin/saccade-server --config /etc/saccade/saccade.toml"));
  EXPECT_THAT(unit, Contains("User=saccade"));
  EXPECT_THAT(unit, Contains("StateDirectory=saccade"));
  EXPECT_THAT(Lines(At("/etc/saccade/saccade.toml")), Contains("data_dir = \"/var/lib/saccade\""));
  EXPECT_THAT(Lines(SACCADE_SOURCE_DIR "/deploy/debian/conffiles"),
              ::testing::ElementsAre("/etc/saccade/saccade.toml"));
}

// It reads its file where it is installed, as the unit says, but for ports and data of our own.
TEST_F(Installed, ServerRunsFromThere) {
  const RunResult run =
      RunProgram({At("/usr/bin/saccade-server").string(), "--config",
                  At("/etc/saccade/saccade.toml").string(), "--data-dir", At("/state").string(),
                  "--grpc", "127.0.0.1:0", "--http", "127.0.0.1:0", "--run-for", "0.5"},
                 std::chrono::seconds(60));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, ::testing::HasSubstr("\"tls\":false"));
}

}  // namespace
}  // namespace saccade::testing::package_test
