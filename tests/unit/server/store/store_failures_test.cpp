#include <sqlite3.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>

#include "tests/unit/server/store/store_fixture.hpp"

namespace saccade::store_failures_test {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using testing::StoreTest;

class StoreFailures : public StoreTest {
 protected:
  absl::Status TryOpen() { return AnnotationStore::Open(directory_).status(); }
  void Execute(const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(file().c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }

  /// Fills the store until a commit fails; checks that it says so and keeps what it accepted.
  void FillUntilRefused(AnnotationStore& store) {
    std::size_t accepted = 0;
    absl::Status failure;
    for (std::uint64_t i = 1; failure.ok(); ++i) {
      ASSERT_LT(i, 10'000u) << "never full";
      const absl::Status queued =
          store.Submit(Change(i, "id-" + std::to_string(i), std::string(400, 'x')), nullptr);
      failure = queued.ok() ? store.Flush() : queued;
      if (failure.ok()) ++accepted;
    }
    EXPECT_EQ(failure.code(), absl::StatusCode::kResourceExhausted) << failure;
    EXPECT_THAT(failure.message(), HasSubstr("annotations.sqlite"));
    EXPECT_THAT(failure.message(), HasSubstr("make room"));
    EXPECT_EQ(store.failure().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_FALSE(store.Submit(Change(20'000, "late"), nullptr).ok()) << "refuses until Resume";
    EXPECT_GT(accepted, 5u);
    std::printf("%zu changes fitted\n", accepted);
    // Deleting makes room in the file; the store is alive again.
    store.Resume();
    const absl::StatusOr<StoredAnnotations> all = store.LoadAll();
    ASSERT_TRUE(all.ok()) << all.status();
    EXPECT_THAT(all->annotations, SizeIs(accepted)) << "exactly what was accepted";
  }
};

TEST_F(StoreFailures, FullDiskIsNamedAndLosesNothingAccepted) {
  if (::geteuid() != 0 || ::mount("tmpfs", directory_.c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  {
    std::unique_ptr<AnnotationStore> store = Open();
    if (store) FillUntilRefused(*store);
  }
  {  // and after a restart on the same full disk
    const absl::StatusOr<std::unique_ptr<AnnotationStore>> store =
        AnnotationStore::Open(directory_);
    if (store.ok()) {
      const absl::StatusOr<StoredAnnotations> all = (*store)->LoadAll();
      EXPECT_TRUE(all.ok()) << all.status();
      EXPECT_GT(all.ok() ? all->annotations.size() : 0, 5u);
    } else {
      EXPECT_EQ(store.status().code(), absl::StatusCode::kResourceExhausted) << store.status();
    }
  }
  ::umount(directory_.c_str());
}

TEST_F(StoreFailures, TinyDiskFailsAtOpenInWords) {
  if (::geteuid() != 0 || ::mount("tmpfs", directory_.c_str(), "tmpfs", 0, "size=16k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  const absl::Status status = TryOpen();
  ::umount(directory_.c_str());
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(status.message(), HasSubstr("disk is full"));
}

TEST_F(StoreFailures, SizeLimitIsLikeAFullDisk) {
  AnnotationStore::Options options;
  options.max_bytes = 20 * 4096;
  const absl::StatusOr<std::unique_ptr<AnnotationStore>> store =
      AnnotationStore::Open(directory_, options);
  ASSERT_TRUE(store.ok()) << store.status();
  FillUntilRefused(**store);
}

TEST_F(StoreFailures, SecondProcessIsRefused) {
  const std::unique_ptr<AnnotationStore> store = Open();
  const absl::Status status = TryOpen();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("in use by another saccade-server"));
}

TEST_F(StoreFailures, GarbageIsNotADatabase) {
  std::ofstream(file()) << std::string(8192, 'x');
  const absl::Status status = TryOpen();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(status.message(), HasSubstr("annotations.sqlite"));
}

TEST_F(StoreFailures, DamageInsideIsFound) {
  {
    std::unique_ptr<AnnotationStore> store = Open();
    for (std::uint64_t i = 1; i <= 200; ++i) {
      ASSERT_TRUE(store->Submit(Change(i, "id-" + std::to_string(i)), nullptr).ok());
    }
  }
  std::fstream raw(file(), std::ios::in | std::ios::out | std::ios::binary);
  for (int page = 1; page < 8; ++page) {
    raw.seekp(4096 * page);
    raw << std::string(4096, '\xee');
  }
  raw.close();
  const absl::Status status = TryOpen();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
}

TEST_F(StoreFailures, NewerSchemaIsLeftAlone) {
  Open().reset();
  Execute("PRAGMA user_version = 99");
  const absl::Status status = TryOpen();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("newer version"));
}

TEST_F(StoreFailures, AnotherProgramsDatabaseIsLeftAlone) {
  Execute("CREATE TABLE theirs(x); PRAGMA user_version = 1");
  EXPECT_EQ(TryOpen().code(), absl::StatusCode::kDataLoss);
}

TEST_F(StoreFailures, SenselessRowIsNamed) {
  {
    std::unique_ptr<AnnotationStore> store = Open();
    ASSERT_TRUE(store->Submit(Change(1, "id-7"), nullptr).ok());
  }
  Execute("UPDATE annotations SET covariance_m2 = x'00'");
  const std::unique_ptr<AnnotationStore> store = Open();
  const absl::Status status = store->LoadAll().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("id-7"));
}

TEST_F(StoreFailures, UnusableDirectoryIsNamed) {
  const std::filesystem::path plain = directory_ / "plain";
  std::ofstream(plain) << "a file";
  const absl::Status status = AnnotationStore::Open(plain / "data").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << status;
  EXPECT_THAT(status.message(), HasSubstr("--data-dir"));
}

TEST_F(StoreFailures, ReadOnlyDirectoryIsNamed) {
  Open().reset();
  const bool root = ::geteuid() == 0;
  if (root) {
    if (::mount(directory_.c_str(), directory_.c_str(), nullptr, MS_BIND, nullptr) != 0 ||
        ::mount(nullptr, directory_.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr) !=
            0) {
      ::umount(directory_.c_str());
      GTEST_SKIP() << "needs the right to remount read-only";
    }
  } else {
    ::chmod(file().c_str(), 0444);
    ::chmod(directory_.c_str(), 0555);
  }
  const absl::Status status = TryOpen();
  if (root) {
    ::umount(directory_.c_str());
  } else {
    ::chmod(directory_.c_str(), 0755);
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << status;
  EXPECT_THAT(status.message(), HasSubstr("--data-dir"));
}

}  // namespace
}  // namespace saccade::store_failures_test
