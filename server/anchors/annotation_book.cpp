#include "server/anchors/annotation_book.hpp"

#include <absl/strings/str_cat.h>

#include <mutex>
#include <utility>

namespace saccade {
namespace {

constexpr std::size_t kMaxRequests = 10'000;

}  // namespace

class AnnotationBook::Owed {
 public:
  explicit Owed(std::function<void()> wake) : wake_(std::move(wake)) {}
  void Add(std::function<void()> answer) {
    {
      const std::lock_guard lock(mutex_);
      answers_.push_back(std::move(answer));
    }
    if (wake_) wake_();
  }
  std::vector<std::function<void()>> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }

 private:
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::vector<std::function<void()>> answers_;
};

absl::StatusOr<std::unique_ptr<AnnotationBook>> AnnotationBook::Open(
    AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed,
    std::unique_ptr<AnnotationJournal> store, std::function<void()> wake) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  std::unique_ptr<AnnotationBook> book(new AnnotationBook(
      std::move(options), std::move(frames), std::move(seed), std::move(store), std::move(wake)));
  if (!book->store_) return book;
  absl::StatusOr<StoredAnnotations> stored = book->store_->LoadAll();
  if (!stored.ok()) return stored.status();
  for (AnsweredRequest& request : stored->requests) {
    book->Keep(request.request_id, {std::move(request.annotation_id), 0});
  }
  book->anchors_.Load(std::move(stored->annotations), stored->last_pin);
  return book;
}

AnnotationBook::AnnotationBook(AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed,
                               std::unique_ptr<AnnotationJournal> store, std::function<void()> wake)
    : anchors_(std::move(options), std::move(frames), std::move(seed)),
      owed_(std::make_shared<Owed>(std::move(wake))),
      store_(std::move(store)) {}

AnnotationBook::~AnnotationBook() {
  store_ = nullptr;
  for (const auto& answer : owed_->Take()) answer();
}

void AnnotationBook::Keep(const std::string& request_id, AnsweredCreate answered) {
  if (request_id.empty()) return;
  requests_[request_id] = std::move(answered);
  request_order_.push_back(request_id);
  if (request_order_.size() <= kMaxRequests) return;
  requests_.erase(request_order_.front());
  request_order_.pop_front();
}

void AnnotationBook::Settle() {
  if (!store_) return;
  // First: the failure that an answer tells of is then seen below, unless it was settled before.
  const std::vector<std::function<void()>> answers = owed_->Take();
  const absl::Status failure = store_->failure();
  const std::uint64_t committed = store_->committed_sequence();
  anchors_.Committed(committed);
  if (!failure.ok()) {
    anchors_.RollBack(committed);
    absl::erase_if(requests_, [committed](const auto& request) {
      return request.second.sequence > committed;
    });
    store_->Resume();
  }
  for (const auto& answer : answers) answer();
}

bool AnnotationBook::AnswerAgain(const std::string& request_id, const AnnotationDone& done) {
  const auto found = requests_.find(request_id);
  if (request_id.empty() || found == requests_.end()) return false;
  const std::string& id = found->second.annotation_id;
  std::optional<Annotation> annotation = anchors_.Get(id);
  if (!annotation) {
    done(absl::FailedPreconditionError(
        absl::StrCat("request_id ", request_id, " created annotation ", id,
                     ", which was deleted since; use a new request_id")));
  } else if (!store_) {
    done(*std::move(annotation));
  } else {  // the first answer may still be on its way to the disk
    const absl::Status queued = store_->SubmitBarrier(
        [done, answer = *std::move(annotation), owed = owed_](const absl::Status& status) {
          if (status.ok()) return done(answer);
          owed->Add([done, status] { done(status); });
        });
    if (!queued.ok()) done(queued);
  }
  return true;
}

void AnnotationBook::Commit(AnnotationEdit edit, AnnotationDone done) {
  const std::uint64_t sequence = edit.change.sequence, first = edit.first_sequence();
  if (!store_) {
    anchors_.Committed(sequence);
    done(edit.annotation);
    return;
  }
  std::vector<AnnotationChange> changes = std::move(edit.with);
  changes.push_back(std::move(edit.change));
  const absl::Status queued = store_->SubmitAll(
      std::move(changes),
      [done, answer = std::move(edit.annotation), owed = owed_](const absl::Status& status) {
        if (status.ok()) return done(answer);
        owed->Add([done, status] { done(status); });
      });
  if (queued.ok()) return;
  anchors_.RollBack(first - 1);
  absl::erase_if(requests_,
                 [sequence](const auto& request) { return request.second.sequence == sequence; });
  Settle();
  done(queued);
}

void AnnotationBook::Create(const AnnotationDraft& draft, const Editor& editor,
                            AnnotationDone done) {
  Settle();
  if (AnswerAgain(draft.request_id, done)) return;
  absl::StatusOr<AnnotationEdit> edit = anchors_.Create(draft, editor);
  if (!edit.ok()) return done(edit.status());
  Keep(draft.request_id, {edit->change.id, edit->change.sequence});
  Commit(*std::move(edit), std::move(done));
}

void AnnotationBook::Update(const AnnotationPatch& patch, const Editor& editor,
                            AnnotationDone done) {
  Settle();
  absl::StatusOr<AnnotationEdit> edit = anchors_.Update(patch, editor);
  if (!edit.ok()) return done(edit.status());
  Commit(*std::move(edit), std::move(done));
}

void AnnotationBook::Delete(const std::string& id, const Editor& editor, AnnotationDone done) {
  Settle();
  absl::StatusOr<AnnotationEdit> edit = anchors_.Delete(id, editor);
  if (!edit.ok()) return done(edit.status());
  Commit(*std::move(edit), std::move(done));
}

void AnnotationBook::Tick(const std::string& id, std::size_t index, bool ticked,
                          const Editor& editor, AnnotationDone done) {
  Settle();
  absl::StatusOr<AnnotationEdit> edit = anchors_.Tick(id, index, ticked, editor);
  if (!edit.ok()) return done(edit.status());
  Commit(*std::move(edit), std::move(done));
}

void AnnotationBook::TakeBack(absl::StatusOr<AnnotationEdit> edit, DescriptionDone done) {
  if (!edit.ok()) return done(edit.status());
  const std::string description = edit->description;
  Commit(*std::move(edit), [done, description](const absl::StatusOr<Annotation>& annotation) {
    annotation.ok() ? done(description) : done(annotation.status());
  });
}

void AnnotationBook::Undo(const Editor& editor, DescriptionDone done) {
  Settle();
  TakeBack(anchors_.Undo(editor), std::move(done));
}

void AnnotationBook::Redo(const Editor& editor, DescriptionDone done) {
  Settle();
  TakeBack(anchors_.Redo(editor), std::move(done));
}

std::vector<AnchorMoved> AnnotationBook::OnSnapshot(std::shared_ptr<const MapSnapshot> snapshot,
                                                    const CameraModel& camera) {
  Settle();
  std::vector<AnchorMoved> moved = anchors_.Resolve(std::move(snapshot), camera);
  if (store_) {
    for (AnnotationChange& change : anchors_.TakeRefinements()) {
      // Costs nothing if refused: the next refinement carries it.
      store_->Submit(std::move(change), nullptr).IgnoreError();
    }
  }
  return moved;
}

}  // namespace saccade
