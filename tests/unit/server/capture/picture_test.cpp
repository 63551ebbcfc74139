// Pictures that ask for more than they hold, and a process that has no more to give.
#include <gmock/gmock.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "server/capture/dataset.hpp"
#include "server/capture/image_file.hpp"
#include "server/capture/picture_header.hpp"
#include "shared/io/log.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::picture_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Pictures : public DatasetFixture {
 protected:
  std::string Read(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  absl::StatusOr<cv::Size> SizeOf(const std::string& bytes) const {
    return ReadPictureSize({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }
  std::unique_ptr<FrameSource> Open(bool realtime) const {
    SourceOptions options;
    options.realtime = realtime;
    auto source = OpenDataset(folder_, options);
    EXPECT_TRUE(source.ok()) << source.status();
    return source.ok() ? *std::move(source) : nullptr;
  }
};

TEST_F(Pictures, SizeIsReadFromEveryKindOfHeader) {
  const cv::Mat grey(37, 53, CV_8UC1, cv::Scalar(7)), color(37, 53, CV_8UC3, cv::Scalar(1, 2, 3));
  for (const std::string name : {"a.png", "a.jpg", "a.pgm", "a.ppm", "a.bmp", "a.tiff", "a.webp"}) {
    for (const cv::Mat& picture : {grey, color}) {
      if (name == (picture.channels() == 1 ? "a.ppm" : "a.pgm")) continue;
      ASSERT_TRUE(cv::imwrite((folder_ / name).string(), picture)) << name;
      const absl::StatusOr<cv::Size> size = SizeOf(Read(name));
      ASSERT_TRUE(size.ok()) << name << size.status();
      EXPECT_EQ(*size, cv::Size(53, 37)) << name;
      EXPECT_TRUE(LoadPicture(folder_ / name).ok()) << name;
    }
  }
  ASSERT_TRUE(
      cv::imwrite((folder_ / "lossy.webp").string(), color, {cv::IMWRITE_WEBP_QUALITY, 60}));
  EXPECT_EQ(SizeOf(Read("lossy.webp")).value(), cv::Size(53, 37));
  EXPECT_EQ(SizeOf("P5\n# a remark\n 53 # 99\n37\n255\n").value(), cv::Size(53, 37));
}

TEST_F(Pictures, EveryBeginningOfAHeaderIsReadSafely) {
  const cv::Mat grey(37, 53, CV_8UC1, cv::Scalar(7));
  for (const char* name : {"a.png", "a.jpg", "a.pgm", "a.bmp", "a.tiff", "a.webp"}) {
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), grey)) << name;
    const std::string whole = Read(name);
    for (std::size_t size = 0; size < std::min<std::size_t>(whole.size(), 700); ++size) {
      SizeOf(whole.substr(0, size)).status().IgnoreError();  // under the sanitizers: no byte beyond
    }
  }
}

TEST_F(Pictures, ABombIsRefusedByItsHeader) {
  // 30000 x 30000 in 900 bytes: 2.7 GB to whoever believes it.
  std::string png = Read("rgb/0.png");
  for (const std::size_t at : {16, 20}) png.replace(at, 4, std::string("\x00\x00\x75\x30", 4));
  Write("bomb.png", png);
  const absl::Status status = LoadPicture(folder_ / "bomb.png").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr("bomb.png"), HasSubstr("30000x30000"), HasSubstr("scale it down")));
  Write("rgb/2.png", png);
  auto source = Open(false);
  std::vector<FrameId> ids;
  for (auto frame = source->Next(); frame.ok() && *frame; frame = source->Next()) {
    ids.push_back((*frame)->id);
  }
  EXPECT_THAT(ids, ElementsAre(0, 1, 3, 4, 5));
  EXPECT_EQ(source->bad_frames(), 1);
}

/// Loads `file` in a child that may take `bytes` more than it has. 0: a picture, 1: a status; else
/// it was ended.
int LoadWithin(const std::filesystem::path& file, std::size_t bytes) {
  const pid_t child = fork();
  if (child == 0) {
    malloc_trim(0);
    std::ifstream statm("/proc/self/statm");
    std::size_t pages = 0;
    statm >> pages;
    const rlim_t limit = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + bytes;
    const rlimit memory{limit, limit};
    setrlimit(RLIMIT_AS, &memory);
    _exit(LoadPicture(file).ok() ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

// Before: the grey copy was made outside of what caught exceptions, and the process ended.
TEST_F(Pictures, AnyShortageOfMemoryIsABadFrame) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need the address space";
#endif
  const cv::Mat color(3000, 3000, CV_8UC3, cv::Scalar(1, 2, 3));  // 27 MB, and 9 MB grey
  cv::imwrite((folder_ / "big.png").string(), color);
  int refused = 0, loaded = 0;
  for (std::size_t megabytes = 1; megabytes <= 64; megabytes += 3) {
    const int result = LoadWithin(folder_ / "big.png", megabytes << 20);
    ASSERT_LE(result, 1) << "with " << megabytes << " MB";
    ++(result == 0 ? loaded : refused);
  }
  std::printf("%d refused, %d loaded\n", refused, loaded);
  EXPECT_GE(refused, 1);  // how many: what the process had mapped before counts
  EXPECT_GE(loaded, 1);
}

TEST_F(Pictures, WhatIsNoFileIsABadFrameAtOnce) {
  std::filesystem::remove(PicturePath(1));
  ASSERT_EQ(mkfifo(PicturePath(1).c_str(), 0600), 0);
  std::filesystem::remove(PicturePath(2));
  std::filesystem::create_symlink("/dev/zero", PicturePath(2));
  std::filesystem::remove(PicturePath(3));
  std::filesystem::create_directory(PicturePath(3));
  auto source = Open(false);
  std::vector<FrameId> ids;
  for (auto frame = source->Next(); frame.ok() && *frame; frame = source->Next()) {
    ids.push_back((*frame)->id);
  }
  EXPECT_THAT(ids, ElementsAre(0, 4, 5));
}

/// Takes the process its file descriptors, and gives them back.
class NoDescriptors {
 public:
  NoDescriptors() {
    const int lowest = dup(0);
    close(lowest);
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit none = before_;
    none.rlim_cur = static_cast<rlim_t>(lowest);
    setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

class Descriptors : public Pictures, public ::testing::WithParamInterface<bool> {};

// Before: each frame was skipped in a moment ("cannot be read"), to the end of the data set.
TEST_P(Descriptors, TheSourceWaitsForOneAndGoesOnWithTheSameFrame) {
  auto source = Open(GetParam());
  std::vector<FrameId> ids;
  FlushLog(std::chrono::seconds(5));  // of the tests before
  ::testing::internal::CaptureStderr();
  std::optional<NoDescriptors> none(std::in_place);
  std::jthread reader([&] {
    for (auto frame = source->Next(); frame.ok() && *frame; frame = source->Next()) {
      ids.push_back((*frame)->id);
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  none.reset();
  reader.join();
  FlushLog(std::chrono::seconds(5));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(ids.front(), 0);
  EXPECT_EQ(ids.back(), 5);
  if (!GetParam()) {
    EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 5));
  }
  EXPECT_EQ(source->bad_frames(), 0);
  EXPECT_THAT(said, AllOf(HasSubstr("frame 0 waits"), HasSubstr("Too many open files")));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
}

TEST_P(Descriptors, AWaitingSourceStopsAtOnce) {
  auto source = Open(GetParam());
  const NoDescriptors none;
  std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    source->Stop();
  });
  const Timestamp begin = MonotonicNow();
  EXPECT_FALSE(*source->Next());
  EXPECT_LT(Seconds(MonotonicNow() - begin), 2.0);
  EXPECT_EQ(source->bad_frames(), 0);
}

INSTANTIATE_TEST_SUITE_P(Both, Descriptors, ::testing::Bool(),
                         [](const auto& each) { return each.param ? "Realtime" : "EveryFrame"; });

}  // namespace
}  // namespace saccade::picture_test
