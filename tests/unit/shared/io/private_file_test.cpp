#include "shared/io/private_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "shared/io/qr_code.hpp"

namespace saccade::private_file_test {
namespace {

namespace fs = std::filesystem;

class PrivateFile : public ::testing::Test {
 protected:
  PrivateFile() {
    std::string pattern = (fs::temp_directory_path() / "saccade-private-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~PrivateFile() override { fs::remove_all(folder_); }
  static std::string Read(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path folder_;
};

TEST_F(PrivateFile, IsForItsOwnerAloneAlsoWhereItWasOpenBefore) {
  const fs::path file = folder_ / "secret";
  std::ofstream(file) << "old";
  ASSERT_EQ(chmod(file.c_str(), 0666), 0);
  EXPECT_EQ(WritePrivateFile(file, "new"), 0);
  EXPECT_EQ(Read(file), "new");
  struct stat facts {};
  ASSERT_EQ(stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777u, 0600u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "nothing is left beside it";
}

TEST_F(PrivateFile, AFailureLeavesWhatWasThere) {
  EXPECT_EQ(WritePrivateFile(folder_ / "none/secret", "x"), ENOENT);
  fs::create_directory(folder_ / "folder");
  EXPECT_NE(WritePrivateFile(folder_ / "folder", "x"), 0);
  EXPECT_TRUE(fs::is_directory(folder_ / "folder"));
}

TEST(QrCode, HasItsFindersAndNoneForWhatIsTooLong) {
  const std::vector<std::string> lines = QrCodeLines("https://10.0.0.7:8080/wearer#invite=iab.c");
  ASSERT_GT(lines.size(), 10u);
  // A finder's first rows: seven dark, then light; the upper half first. Two modules are quiet.
  const std::string finder = "\u2588\u2580\u2580\u2580\u2580\u2580\u2588";
  const std::size_t left = lines[1].find("  " + finder + " ");
  const std::size_t right = lines[1].rfind(" " + finder + "  ");
  EXPECT_NE(left, std::string::npos) << lines[1];
  EXPECT_NE(right, std::string::npos) << lines[1];
  EXPECT_GT(right, left + finder.size());
  EXPECT_TRUE(QrCodeLines(std::string(4000, 'x')).empty());
}

}  // namespace
}  // namespace saccade::private_file_test
