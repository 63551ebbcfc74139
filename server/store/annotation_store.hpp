#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/anchors/annotation_journal.hpp"

namespace saccade {

/// Annotations in DIR/annotations.sqlite: WAL, synchronous=FULL, one process at a time, readable by
/// their owner alone. Files that are deleted while it runs are written again, before the next
/// change is answered and within a second or so in any case; another file in their place is left
/// alone and changes are refused (FailedPrecondition).
///
/// Submit queues; one thread commits all that is queued in one transaction and then calls back. If
/// a transaction fails, every change queued so far fails with the same error and the store refuses
/// all further ones until Resume(): the owner first takes its memory back to what is on disk.
class AnnotationStore final : public AnnotationJournal {
 public:
  struct Options {
    std::size_t max_queued = 4096;
    /// Largest size of the file; 0: none. Reaching it is reported like a full disk.
    std::int64_t max_bytes = 0;
  };
  /// Opens or creates the file in `directory` (created if absent) and brings its schema up to date.
  /// Errors name the file and the remedy:
  ///   PermissionDenied    directory or file not writable
  ///   ResourceExhausted   no room on the disk
  ///   DataLoss            not a database, damaged, or emptied (0 bytes)
  ///   FailedPrecondition  written by a newer version, or in use by another process
  static absl::StatusOr<std::unique_ptr<AnnotationStore>> Open(
      const std::filesystem::path& directory, const Options& options);
  static absl::StatusOr<std::unique_ptr<AnnotationStore>> Open(
      const std::filesystem::path& directory);

  ~AnnotationStore() override;

  // Answers come on the commit thread.
  absl::StatusOr<StoredAnnotations> LoadAll() override;
  absl::Status SubmitAll(std::vector<AnnotationChange> changes, Done done) override;
  absl::Status SubmitBarrier(Done done) override;
  std::uint64_t committed_sequence() const override;
  absl::Status failure() const override;
  void Resume() override;
  absl::Status Flush(std::chrono::milliseconds limit) override;
  absl::Status Flush() { return Flush(std::chrono::hours(1)); }

 private:
  class Impl;
  explicit AnnotationStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
