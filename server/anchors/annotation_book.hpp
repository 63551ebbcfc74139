#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/annotation_journal.hpp"

namespace saccade {

/// The annotations as RPCs see them: AnchorManager with a journal behind it. Every call but
/// Latest() on the tracker thread. An answer is given after commit, once, on the journal's thread
/// (or at once on the caller's, for a refusal); it must not call back into the book. An edit that
/// cannot be saved is taken back before it is answered, so that whoever hears of it lists what is
/// on disk.
class AnnotationBook {
 public:
  using AnnotationDone = std::function<void(const absl::StatusOr<Annotation>&)>;
  using DescriptionDone = std::function<void(const absl::StatusOr<std::string>&)>;

  /// Loads what the journal keeps. `store` may be null: nothing is kept (offline evaluation),
  /// answers come at once. `wake` asks for a Settle() soon, on any thread; without it edits that
  /// could not be saved are answered at the next call.
  static absl::StatusOr<std::unique_ptr<AnnotationBook>> Open(
      AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed,
      std::unique_ptr<AnnotationJournal> store, std::function<void()> wake = nullptr);
  /// Commits what is queued and gives every answer that is owed.
  ~AnnotationBook();

  /// A draft whose request id was answered before is answered with that annotation again.
  void Create(const AnnotationDraft& draft, const Editor& editor, AnnotationDone done);
  void Update(const AnnotationPatch& patch, const Editor& editor, AnnotationDone done);
  void Delete(const std::string& id, const Editor& editor, AnnotationDone done);
  void Tick(const std::string& id, std::size_t index, bool ticked, const Editor& editor,
            AnnotationDone done);
  /// The description says what was done, e.g. "deleted cube 6f1c...".
  void Undo(const Editor& editor, DescriptionDone done);
  void Redo(const Editor& editor, DescriptionDone done);

  /// Once per frame, after the tracker: settles commits, recomputes anchors, publishes. Returns the
  /// jumps.
  std::vector<AnchorMoved> OnSnapshot(std::shared_ptr<const MapSnapshot> snapshot,
                                      const CameraModel& camera);

  /// Of the place, from the next snapshot on.
  void SetSurface(std::shared_ptr<const SurfaceSnapshot> surface) {
    anchors_.SetSurface(std::move(surface));
  }

  /// Whose coordinates the map has from the next snapshot on (UUID): what was placed in it, in this
  /// run or another, is where it was.
  void SetWorld(std::string world) { anchors_.SetWorld(std::move(world)); }

  /// Follows the store: forgets what is on disk; after a failed commit takes memory back to it and
  /// answers those whose edits were lost. Every other call begins with it.
  void Settle();

  /// As AnnotationJournal::Flush. Any thread.
  absl::Status Flush(std::chrono::milliseconds limit) {
    return store_ ? store_->Flush(limit) : absl::OkStatus();
  }

  /// The session ended: what it did can no longer be undone.
  void ForgetPerson(const std::string& person_id) { anchors_.ForgetPerson(person_id); }

  /// All annotations, oldest first; never null. Any thread.
  std::shared_ptr<const std::vector<Annotation>> Latest() const { return anchors_.Latest(); }

 private:
  AnnotationBook(AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed,
                 std::unique_ptr<AnnotationJournal> store, std::function<void()> wake);
  /// Answers to edits that could not be saved, until memory is taken back. Any thread.
  class Owed;
  struct AnsweredCreate {
    std::string annotation_id;
    std::uint64_t sequence = 0;  // 0: before this run
  };

  /// Answers a Create that was made before; false if it was not.
  bool AnswerAgain(const std::string& request_id, const AnnotationDone& done);
  void Keep(const std::string& request_id, AnsweredCreate answered);
  void Commit(AnnotationEdit edit, AnnotationDone done);
  void TakeBack(absl::StatusOr<AnnotationEdit> edit, DescriptionDone done);

  AnchorManager anchors_;
  std::shared_ptr<Owed> owed_;
  std::unique_ptr<AnnotationJournal> store_;
  absl::flat_hash_map<std::string, AnsweredCreate> requests_;  // by request id
  std::deque<std::string> request_order_;                      // oldest first
};

}  // namespace saccade
