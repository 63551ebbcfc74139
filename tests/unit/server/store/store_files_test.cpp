// What others do to the data base's files, before and while the server has them.
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "shared/io/log.hpp"
#include "tests/unit/server/store/store_fixture.hpp"

namespace saccade::store_files_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using testing::StoreTest;

class StoreFiles : public StoreTest {
 protected:
  StoreFiles() : data_(directory_ / "data") {}

  std::unique_ptr<AnnotationStore> OpenData() {
    auto store = AnnotationStore::Open(data_);
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  absl::Status Save(AnnotationStore& store, std::uint64_t sequence) {
    const absl::Status queued =
        store.Submit(Change(sequence, "id-" + std::to_string(sequence)), nullptr);
    return queued.ok() ? store.Flush() : queued;
  }
  void SaveThree(AnnotationStore& store) {
    for (std::uint64_t i = 1; i <= 3; ++i) ASSERT_TRUE(Save(store, i).ok());
  }
  /// How many annotations a server would find if this process were killed now.
  std::size_t FoundAfterAKill() {
    const fs::path copy = directory_ / "copy";
    fs::remove_all(copy);
    fs::copy(data_, copy);
    const auto store = AnnotationStore::Open(copy);
    EXPECT_TRUE(store.ok()) << store.status();
    const auto all = store.ok() ? (*store)->LoadAll() : absl::StatusOr<StoredAnnotations>();
    return all.ok() ? all->annotations.size() : 0;
  }
  /// Waits until the idle store has looked after its files.
  void WaitFor(const fs::path& file) {
    for (int i = 0; i < 500 && !fs::exists(file); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(fs::exists(file));
  }
  static int Mode(const fs::path& file) {
    struct stat what {};
    EXPECT_EQ(::stat(file.c_str(), &what), 0) << file;
    return static_cast<int>(what.st_mode & 0777);
  }
  std::string Said(const std::function<void()>& what) {
    FlushLog(std::chrono::seconds(5));  // of the tests before
    ::testing::internal::CaptureStderr();
    what();
    FlushLog(std::chrono::seconds(5));
    return ::testing::internal::GetCapturedStderr();
  }

  const fs::path data_;
};

// Before: each was answered OK, and gone with the process.
TEST_F(StoreFiles, ADeletedDataBaseIsWrittenAgainBeforeTheNextAnswer) {
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  const std::string said = Said([&] {
    for (const char* name :
         {"annotations.sqlite", "annotations.sqlite-wal", "annotations.sqlite-shm"}) {
      fs::remove(data_ / name);
    }
    EXPECT_TRUE(Save(*store, 4).ok());
  });
  EXPECT_THAT(said, AllOf(HasSubstr("annotations.sqlite"), HasSubstr("was deleted"),
                          HasSubstr("written again")));
  EXPECT_EQ(FoundAfterAKill(), 4u);
  EXPECT_EQ(Mode(data_ / "annotations.sqlite"), 0600);
  EXPECT_TRUE(Save(*store, 5).ok()) << "goes on";
  EXPECT_EQ(FoundAfterAKill(), 5u);
}

TEST_F(StoreFiles, ADeletedDataBaseIsWrittenAgainWithoutAnEdit) {
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  fs::remove(data_ / "annotations.sqlite");
  WaitFor(data_ / "annotations.sqlite");
  EXPECT_EQ(FoundAfterAKill(), 3u);
}

TEST_F(StoreFiles, TheWholeDirectoryIsMadeAgain) {
  std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  fs::remove_all(data_);
  EXPECT_TRUE(Save(*store, 4).ok());
  EXPECT_EQ(AnnotationStore::Open(data_).status().code(), absl::StatusCode::kFailedPrecondition)
      << "still one server for one directory";
  EXPECT_EQ(Mode(data_), 0700);
  EXPECT_EQ(FoundAfterAKill(), 4u);
  store.reset();
  EXPECT_THAT(OpenData()->LoadAll()->annotations, SizeIs(4));
}

TEST_F(StoreFiles, AMovedDataBaseIsWrittenAgain) {
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  fs::rename(data_ / "annotations.sqlite", directory_ / "elsewhere");
  EXPECT_TRUE(Save(*store, 4).ok());
  EXPECT_EQ(FoundAfterAKill(), 4u);
}

TEST_F(StoreFiles, AnotherFileInItsPlaceIsLeftAloneAndNothingIsPromised) {
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  std::ofstream(directory_ / "theirs") << "precious";
  fs::rename(directory_ / "theirs", data_ / "annotations.sqlite");
  const absl::Status refused = Save(*store, 4);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("annotations.sqlite"), HasSubstr("was replaced"),
                                       HasSubstr("move that file away"), HasSubstr("restart")));
  std::string text;
  std::getline(std::ifstream(data_ / "annotations.sqlite") >> std::ws, text);
  EXPECT_EQ(text, "precious");
  store->Resume();
  fs::rename(data_ / "annotations.sqlite", directory_ / "theirs");
  EXPECT_TRUE(Save(*store, 5).ok());
  EXPECT_EQ(FoundAfterAKill(), 4u) << "three and the fifth";
}

TEST_F(StoreFiles, ADeletedLogLosesNothing) {
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  for (std::uint64_t i = 4; i < 8; ++i) {
    fs::remove(data_ / (i % 2 == 0 ? "annotations.sqlite-wal" : "annotations.sqlite-shm"));
    EXPECT_TRUE(Save(*store, i).ok());
    EXPECT_EQ(FoundAfterAKill(), i);
  }
}

TEST_F(StoreFiles, WhatIsDeletedJustBeforeTheEndIsThereAfterIt) {
  std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  fs::remove_all(data_);
  store.reset();
  EXPECT_THAT(OpenData()->LoadAll()->annotations, SizeIs(3));
}

// Before: it began empty, without a word.
TEST_F(StoreFiles, AnEmptiedFileIsRefused) {
  {
    const std::unique_ptr<AnnotationStore> store = OpenData();
    SaveThree(*store);
  }
  fs::resize_file(data_ / "annotations.sqlite", 0);
  const absl::Status status = AnnotationStore::Open(data_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr("annotations.sqlite"), HasSubstr("0 bytes"), HasSubstr("remove it")));
  EXPECT_EQ(fs::file_size(data_ / "annotations.sqlite"), 0u) << "left as it is";
}

TEST_F(StoreFiles, WhatIsNoFileIsRefused) {
  fs::create_directories(data_);
  ASSERT_EQ(::mkfifo((data_ / "annotations.sqlite").c_str(), 0600), 0);
  EXPECT_THAT(AnnotationStore::Open(data_).status().message(), HasSubstr("no regular file"));
}

TEST_F(StoreFiles, OnlyTheOwnerMayReadThem) {
  const mode_t before = ::umask(0);
  const std::unique_ptr<AnnotationStore> store = OpenData();
  SaveThree(*store);
  ::umask(before);
  EXPECT_EQ(Mode(data_), 0700);
  for (const char* name : {"annotations.sqlite", "annotations.sqlite-wal", "annotations.sqlite-shm",
                           "annotations.lock"}) {
    EXPECT_EQ(Mode(data_ / name), 0600) << name;
  }
}

TEST_F(StoreFiles, FilesOfEarlierVersionsAreClosedToOthersWithANote) {
  OpenData().reset();
  ::chmod(data_.c_str(), 0755);
  ::chmod((data_ / "annotations.sqlite").c_str(), 0644);
  ::chmod((data_ / "annotations.lock").c_str(), 0644);
  const std::string said = Said([&] { OpenData().reset(); });
  EXPECT_THAT(said, AllOf(HasSubstr("annotations.sqlite: was open to others (644)"),
                          HasSubstr("annotations.lock: was open"), HasSubstr("data: was open")));
  EXPECT_EQ(Mode(data_), 0700);
  EXPECT_EQ(Mode(data_ / "annotations.sqlite"), 0600);
  std::ofstream(data_ / "something else") << "shared";
  ::chmod(data_.c_str(), 0755);
  OpenData().reset();
  EXPECT_EQ(Mode(data_), 0755) << "not ours alone";
}

TEST_F(StoreFiles, ALogWithoutItsDataBaseIsPutAside) {
  {
    const std::unique_ptr<AnnotationStore> store = OpenData();
    SaveThree(*store);
    fs::create_directories(directory_ / "kept");
    fs::copy(data_, directory_ / "kept");
  }
  fs::remove_all(data_);
  fs::copy(directory_ / "kept", data_);
  fs::remove(data_ / "annotations.sqlite");
  const std::string said =
      Said([&] { EXPECT_THAT(OpenData()->LoadAll()->annotations, SizeIs(0)); });
  EXPECT_THAT(said, AllOf(HasSubstr("is missing"), HasSubstr("annotations.sqlite-wal.")));
}

}  // namespace
}  // namespace saccade::store_files_test
