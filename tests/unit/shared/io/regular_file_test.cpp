#include "shared/io/regular_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

namespace saccade::regular_file_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

class RegularFile : public ::testing::Test {
 protected:
  RegularFile() {
    std::string pattern = (fs::temp_directory_path() / "saccade-io-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~RegularFile() override { fs::remove_all(folder_); }
  absl::StatusOr<std::string> Read(const fs::path& file, std::size_t most = 1000) const {
    return ReadRegularFile(file, most, "a note");
  }
  fs::path folder_;
};

TEST_F(RegularFile, IsReadWhole) {
  const std::string text = std::string("a\0b\n", 4) + std::string(900, 'x');
  std::ofstream(folder_ / "f", std::ios::binary) << text;
  EXPECT_EQ(Read(folder_ / "f").value(), text);
  std::ofstream(folder_ / "empty");
  EXPECT_EQ(Read(folder_ / "empty").value(), "");
  fs::create_symlink(folder_ / "f", folder_ / "link");
  EXPECT_EQ(Read(folder_ / "link").value(), text);
  EXPECT_FALSE(Read("/proc/self/status", 100'000)->empty()) << "says it has 0 bytes";
}

TEST_F(RegularFile, WhatIsNoneIsNamedAndNeverWaitedFor) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const auto begin = std::chrono::steady_clock::now();
  const auto refuse = [&](const fs::path& file, const char* what) {
    const absl::Status status = Read(file).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(status.message(),
                AllOf(HasSubstr(file.string()), HasSubstr(what), HasSubstr("not a note")));
  };
  refuse(folder_ / "pipe", "a named pipe");
  refuse(folder_, "a folder");
  refuse("/dev/zero", "a device");
  refuse("/dev/tty", "a device");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(RegularFile, TooLongIsRefusedWithoutReading) {
  std::ofstream(folder_ / "huge");
  fs::resize_file(folder_ / "huge", std::uintmax_t{1} << 40);  // a hole of a terabyte
  const absl::Status status = Read(folder_ / "huge").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("too long for a note"), HasSubstr("1000")));
  EXPECT_FALSE(Read("/proc/self/maps", 100).ok()) << "longer than it says";
}

TEST_F(RegularFile, MissingAndForbiddenAreToldApart) {
  EXPECT_EQ(Read(folder_ / "none").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Read(folder_ / std::string(5000, 'x')).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(MayExist(folder_ / "none"));
  EXPECT_TRUE(MayExist(folder_ / std::string(5000, 'x'))) << "no exception: opening it will tell";
}

TEST_F(RegularFile, RunningOutOfDescriptorsIsNoFaultOfTheFile) {
  std::ofstream(folder_ / "f") << "text";
  const int lowest = dup(0);
  ASSERT_GE(lowest, 0);
  close(lowest);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = static_cast<rlim_t>(lowest);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const absl::Status status = Read(folder_ / "f").status();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_TRUE(Read(folder_ / "f").ok());
}

}  // namespace
}  // namespace saccade::regular_file_test
