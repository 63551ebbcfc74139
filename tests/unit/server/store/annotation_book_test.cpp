#include "server/anchors/annotation_book.hpp"

#include <sys/mount.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "tests/unit/server/anchors/rig.hpp"
#include "tests/unit/server/store/store_fixture.hpp"

namespace saccade::annotation_book_test {
namespace {

using ::testing::IsEmpty;
using testing::LookFrom;
using testing::RigOptions;
using ::testing::SizeIs;
using testing::StoreTest;
using testing::SyntheticMap;

/// Waits for the one answer.
template <typename T>
class Answer {
 public:
  auto Take() {
    return [this](const absl::StatusOr<T>& answer) {
      const std::lock_guard guard(mutex_);
      EXPECT_FALSE(answer_.has_value()) << "answered twice";
      answer_ = answer;
      wake_.notify_one();
    };
  }
  /// Calls `settle` now and then, as the tracker thread does.
  absl::StatusOr<T> Get(const std::function<void()>& settle = [] {}) {
    for (int i = 0; i < 1000; ++i) {
      {
        std::unique_lock guard(mutex_);
        const auto there = [this] { return answer_.has_value(); };
        if (wake_.wait_for(guard, std::chrono::milliseconds(10), there)) return *answer_;
      }
      settle();
    }
    return absl::DeadlineExceededError("no answer");
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  std::optional<absl::StatusOr<T>> answer_;
};

class BookTest : public StoreTest {
 protected:
  void Start(const AnnotationStore::Options& options = {}) {
    book_.reset();
    absl::StatusOr<std::unique_ptr<AnnotationStore>> store =
        AnnotationStore::Open(directory_, options);
    ASSERT_TRUE(store.ok()) << store.status();
    auto book = AnnotationBook::Open(
        RigOptions(), [this](FrameId id) { return ring_.Find(id); }, nullptr, *std::move(store));
    ASSERT_TRUE(book.ok()) << book.status();
    book_ = *std::move(book);
    Show();
  }
  void Show() { book_->OnSnapshot(map_.Snapshot(LookFrom({0, 0, 0}, 0, 0.2)), *map_.camera()); }
  absl::StatusOr<Annotation> Create(const std::string& request, const std::string& text = "") {
    Answer<Annotation> answer;
    AnnotationDraft draft;
    draft.request_id = request;
    draft.text = text;
    draft.target = PointTarget{{0, 0, 2}};
    book_->Create(draft, "s", answer.Take());
    return answer.Get([this] { book_->Settle(); });
  }

  /// How many were answered with success before one was refused.
  std::size_t CreateUntilFull() {
    for (std::size_t i = 0; i < 1000; ++i) {
      const absl::Status status = Create("r" + std::to_string(i), std::string(400, 'x')).status();
      if (status.ok()) continue;
      EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
      return i;
    }
    ADD_FAILURE() << "never full";
    return 0;
  }

  SyntheticMap map_;
  FrameRing ring_;
  std::unique_ptr<AnnotationBook> book_;
};

TEST_F(BookTest, AnsweredAnnotationsAreBackAfterARestart) {
  Start();
  const absl::StatusOr<Annotation> created = Create("r1", "oil");
  ASSERT_TRUE(created.ok()) << created.status();
  Start();
  ASSERT_THAT(*book_->Latest(), SizeIs(1));
  EXPECT_EQ(book_->Latest()->front().id, created->id);
  EXPECT_EQ(book_->Latest()->front().text, "oil");
  EXPECT_EQ(book_->Latest()->front().anchor.state, AnchorState::kTracking);
}

TEST_F(BookTest, ARepeatedRequestIsAnsweredWithTheFirstResultAlsoAfterARestart) {
  Start();
  const absl::StatusOr<Annotation> first = Create("r1");
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(Create("r1")->id, first->id);
  Start();
  EXPECT_EQ(Create("r1")->id, first->id);
  EXPECT_THAT(*book_->Latest(), SizeIs(1));
  EXPECT_NE(Create("r2")->id, first->id);
  EXPECT_NE(Create("")->id, Create("")->id);
}

TEST_F(BookTest, RefusalsAreAnsweredAtOnce) {
  Start();
  Answer<std::string> answer;
  book_->Undo("s", answer.Take());
  EXPECT_EQ(answer.Get().status().code(), absl::StatusCode::kFailedPrecondition);
  Answer<Annotation> gone;
  book_->Delete("nope", "s", gone.Take());
  EXPECT_EQ(gone.Get().status().code(), absl::StatusCode::kNotFound);
}

TEST_F(BookTest, UndoIsDurable) {
  Start();
  ASSERT_TRUE(Create("r1").ok());
  Answer<std::string> answer;
  book_->Undo("s", answer.Take());
  ASSERT_TRUE(answer.Get().ok());
  Start();
  EXPECT_THAT(*book_->Latest(), IsEmpty());
}

TEST_F(BookTest, AForgottenPersonsChangesStayAndCannotBeUndone) {
  Start();
  ASSERT_TRUE(Create("r1").ok());
  book_->ForgetPerson("s");
  Answer<std::string> answer;
  book_->Undo("s", answer.Take());
  EXPECT_EQ(answer.Get().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(*book_->Latest(), SizeIs(1));
}

TEST_F(BookTest, NothingClaimsToBeSavedOnAFullDisk) {
  AnnotationStore::Options options;
  options.max_bytes = 20 * 4096;
  Start(options);
  const std::size_t saved = CreateUntilFull();
  EXPECT_EQ(book_->Latest()->size(), saved)
      << "the unsaved one is gone from memory before its refusal is heard";
  EXPECT_EQ(Create("once more", std::string(400, 'x')).status().code(),
            absl::StatusCode::kResourceExhausted);
  Start();
  EXPECT_EQ(book_->Latest()->size(), saved);
  EXPECT_TRUE(Create("once more").ok()) << "a refused request is not remembered as done";
}

TEST_F(BookTest, ARefusalIsHeardOnlyWhenMemoryIsWhatTheDiskHas) {
  AnnotationStore::Options options;
  options.max_bytes = 20 * 4096;
  Start(options);
  const std::size_t saved = CreateUntilFull();
  std::atomic<int> woken = 0;
  book_.reset();
  auto store = AnnotationStore::Open(directory_, options);
  ASSERT_TRUE(store.ok());
  auto book = AnnotationBook::Open(
      RigOptions(), [this](FrameId id) { return ring_.Find(id); }, nullptr, *std::move(store),
      [&woken] { ++woken; });
  ASSERT_TRUE(book.ok());
  book_ = *std::move(book);
  Show();
  std::atomic<std::size_t> listed = 0;
  std::atomic<bool> answered = false;
  AnnotationDraft draft;
  draft.text = std::string(400, 'x');
  draft.target = PointTarget{{0, 0, 2}};
  book_->Create(draft, "s", [&](const absl::StatusOr<Annotation>& answer) {
    EXPECT_FALSE(answer.ok());
    listed = book_->Latest()->size();  // what a client lists who was just refused
    answered = true;
  });
  for (int i = 0; i < 1000 && woken == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(woken, 1) << "the tracker is woken, with or without a frame";
  EXPECT_FALSE(answered) << "memory still has what the disk has not";
  book_->Settle();
  EXPECT_TRUE(answered);
  EXPECT_EQ(listed, saved);
}

TEST_F(BookTest, AnEditThatFailsWhileItEndsIsAnsweredToo) {
  AnnotationStore::Options options;
  options.max_bytes = 20 * 4096;
  Start(options);
  CreateUntilFull();
  int answers = 0;
  AnnotationDraft draft;
  draft.text = std::string(400, 'x');
  draft.target = PointTarget{{0, 0, 2}};
  book_->Create(draft, "s", [&](const absl::StatusOr<Annotation>& answer) {
    EXPECT_FALSE(answer.ok());
    ++answers;
  });
  book_.reset();
  EXPECT_EQ(answers, 1);
}

TEST_F(BookTest, WorksAgainOnceThereIsRoomWithoutARestart) {
  if (::geteuid() != 0 || ::mount("tmpfs", directory_.c_str(), "tmpfs", 0, "size=512k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  const std::filesystem::path ballast = directory_ / "ballast";
  std::ofstream(ballast) << std::string(256 * 1024, 'x');
  Start();
  const std::size_t saved = CreateUntilFull();
  std::filesystem::remove(ballast);
  EXPECT_TRUE(Create("again").ok());
  Show();
  EXPECT_EQ(book_->Latest()->size(), saved + 1);
  Start();
  EXPECT_EQ(book_->Latest()->size(), saved + 1);
  book_.reset();
  ::umount(directory_.c_str());
}

TEST_F(BookTest, WithoutAStoreItAnswersAtOnce) {
  auto book = AnnotationBook::Open(
      RigOptions(), [this](FrameId id) { return ring_.Find(id); }, nullptr, nullptr);
  ASSERT_TRUE(book.ok());
  book_ = *std::move(book);
  Show();
  ASSERT_TRUE(Create("r").ok());
  EXPECT_THAT(*book_->Latest(), SizeIs(1));
}

}  // namespace
}  // namespace saccade::annotation_book_test
