#include <signal.h>
#include <sqlite3.h>
#include <sys/wait.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <set>
#include <thread>
#include <vector>

#include "tests/unit/server/store/store_fixture.hpp"

namespace saccade::annotation_store_test {
namespace {

using ::testing::SizeIs;
using testing::StoreTest;

TEST_F(StoreTest, EveryFieldComesBack) {
  std::unique_ptr<AnnotationStore> store = Open();
  const AnnotationChange change = Change(1, "id-1", "ö\"l'; DROP TABLE annotations;--");
  ASSERT_TRUE(store->Submit(change, nullptr).ok());
  store.reset();  // closing commits what is queued
  store = Open();
  const absl::StatusOr<StoredAnnotations> all = store->LoadAll();
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_THAT(all->annotations, SizeIs(1));
  const Annotation& read = all->annotations[0].annotation;
  const Annotation& wrote = change.after->annotation;
  EXPECT_EQ(read.id, wrote.id);
  EXPECT_EQ(read.shape, wrote.shape);
  EXPECT_EQ(read.text, wrote.text);
  EXPECT_EQ(read.author, wrote.author);
  EXPECT_EQ(read.size_m, wrote.size_m);
  EXPECT_EQ(read.color_rgba, wrote.color_rgba);
  EXPECT_EQ(read.created_unix_ns, wrote.created_unix_ns);
  EXPECT_EQ(read.revision, wrote.revision);
  EXPECT_EQ(read.anchor.method, wrote.anchor.method);
  EXPECT_EQ(read.anchor.point_in_world, wrote.anchor.point_in_world);
  EXPECT_EQ(read.anchor.covariance_in_world, wrote.anchor.covariance_in_world);
  EXPECT_EQ(read.anchor.error_m, wrote.anchor.error_m);
  EXPECT_EQ(read.ink_offset_m, wrote.ink_offset_m);
  EXPECT_EQ(all->annotations[0].world_key, change.after->world_key);
  ASSERT_THAT(all->requests, SizeIs(1));
  EXPECT_EQ(all->requests[0].request_id, "request-1");
  EXPECT_EQ(all->requests[0].annotation_id, "id-1");
}

TEST_F(StoreTest, UpdatesReplaceAndDeletesRemove) {
  std::unique_ptr<AnnotationStore> store = Open();
  ASSERT_TRUE(store->Submit(Change(1, "a"), nullptr).ok());
  ASSERT_TRUE(store->Submit(Change(2, "b"), nullptr).ok());
  ASSERT_TRUE(store->Submit(Change(3, "a", "changed"), nullptr).ok());
  AnnotationChange gone = Change(4, "b");
  gone.after.reset();
  ASSERT_TRUE(store->Submit(gone, nullptr).ok());
  ASSERT_TRUE(store->Flush().ok());
  EXPECT_EQ(store->committed_sequence(), 4u);
  const absl::StatusOr<StoredAnnotations> all = store->LoadAll();
  ASSERT_TRUE(all.ok());
  ASSERT_THAT(all->annotations, SizeIs(1));
  EXPECT_EQ(all->annotations[0].annotation.text, "changed");
}

TEST_F(StoreTest, QueuedChangesShareTransactionsAndAnswerInOrder) {
  std::unique_ptr<AnnotationStore> store = Open();
  std::vector<std::uint64_t> answered;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint64_t i = 1; i <= 500; ++i) {
    ASSERT_TRUE(store
                    ->Submit(Change(i, "id-" + std::to_string(i)),
                             [&answered, i](const absl::Status& status) {
                               EXPECT_TRUE(status.ok()) << status;
                               answered.push_back(i);
                             })
                    .ok());
  }
  ASSERT_TRUE(store->Flush().ok());
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  std::printf("500 changes queued at once: %.1f ms\n", ms);
  ASSERT_THAT(answered, SizeIs(500));
  EXPECT_TRUE(std::is_sorted(answered.begin(), answered.end()));
}

TEST_F(StoreTest, AnswersAreDurableAgainstKill) {
  for (int round = 0; round < 8; ++round) {
    int answers[2];
    ASSERT_EQ(::pipe(answers), 0);
    const pid_t child = ::fork();
    if (child == 0) {  // edits as fast as it can and tells each one that was answered
      ::close(answers[0]);
      auto store = AnnotationStore::Open(directory_);
      if (!store.ok()) ::_exit(1);
      for (std::uint64_t i = 1;; ++i) {
        const std::uint64_t number = 100'000ULL * (round + 1) + i;
        const absl::Status queued =
            (*store)->Submit(Change(number, "id-" + std::to_string(number)),
                             [number, &answers](const absl::Status& status) {
                               if (!status.ok()) ::_exit(2);
                               if (::write(answers[1], &number, sizeof(number)) < 0) ::_exit(3);
                             });
        if (!queued.ok()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (i % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    }
    ::close(answers[1]);
    std::set<std::string> answered;
    std::uint64_t number = 0;
    const std::size_t enough = 30 + 17 * round;
    while (answered.size() < enough &&
           ::read(answers[0], &number, sizeof(number)) == sizeof(number)) {
      answered.insert("id-" + std::to_string(number));
    }
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    while (::read(answers[0], &number, sizeof(number)) == sizeof(number)) {
      answered.insert("id-" + std::to_string(number));
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself with " << WEXITSTATUS(status);
    ::close(answers[0]);
    ASSERT_GE(answered.size(), enough);

    std::unique_ptr<AnnotationStore> store = Open();
    ASSERT_TRUE(store);
    const absl::StatusOr<StoredAnnotations> all = store->LoadAll();
    ASSERT_TRUE(all.ok()) << all.status();
    std::set<std::string> kept;
    for (const StoredAnnotation& stored : all->annotations) kept.insert(stored.annotation.id);
    for (const std::string& id : answered) EXPECT_TRUE(kept.contains(id)) << id << " is missing";
  }
}

TEST_F(StoreTest, CommitsOneChangeQuickly) {
  std::unique_ptr<AnnotationStore> store = Open();
  std::vector<double> times_ms;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    const auto start = std::chrono::steady_clock::now();
    ASSERT_TRUE(store->Submit(Change(i, "id"), nullptr).ok());
    ASSERT_TRUE(store->Flush().ok());
    times_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::sort(times_ms.begin(), times_ms.end());
  std::printf("one change to answer: p50 %.2f ms, p99 %.2f ms\n", times_ms[50], times_ms[98]);
  EXPECT_LT(times_ms[50], 100.0);
}

}  // namespace
}  // namespace saccade::annotation_store_test
