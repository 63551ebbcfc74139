#include "server/eval/output_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

namespace saccade::output_file_test {
namespace {

TEST(OutputFile, AFullDiskIsToldWithItsRemedy) {
  auto file = OutputFile::Create("/dev/full");  // every write fails with ENOSPC
  ASSERT_TRUE(file.ok());
  file->Write("some text\n");
  const absl::Status status = file->Flush();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("/dev/full: cannot be written (No space left"),
            absl::string_view::npos);
  EXPECT_NE(status.message().find("free some space"), absl::string_view::npos);
  EXPECT_FALSE(file->Close().ok());
}

TEST(OutputFile, MissingFolderIsTold) {
  EXPECT_FALSE(OutputFile::Create("/nowhere/at/all").ok());
  EXPECT_FALSE(WriteFileAtomically("/nowhere/at/all", "x").ok());
  EXPECT_FALSE(CreateFolder("/dev/null/folder").ok());
}

TEST(OutputFile, AtomicWriteLeavesNoPartBehind) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("saccade-output-" + std::to_string(::getpid()));
  ASSERT_TRUE(CreateFolder(folder / "a").ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "a" / "x.json", "first").ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "a" / "x.json", "second").ok());
  std::ifstream read(folder / "a" / "x.json");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(read), {}), "second");
  const std::filesystem::directory_iterator files(folder / "a");
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace saccade::output_file_test
