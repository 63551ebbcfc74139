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

#include "server/anchors/stored_annotation.hpp"

namespace saccade {

/// A Create that was answered once: request id and the annotation it made.
struct AnsweredRequest {
  std::string request_id;
  std::string annotation_id;
};

struct StoredAnnotations {
  std::vector<StoredAnnotation> annotations;  // oldest first
  std::vector<AnsweredRequest> requests;      // the last 10 000, oldest first
};

/// Annotations in DIR/annotations.sqlite: WAL, synchronous=FULL, one process at a time, readable by
/// their owner alone. Files that are deleted while it runs are written again, before the next
/// change is answered and within a second or so in any case; another file in their place is left
/// alone and changes are refused (FailedPrecondition).
///
/// Submit queues; one thread commits all that is queued in one transaction and then calls back. If
/// a transaction fails, every change queued so far fails with the same error and the store refuses
/// all further ones until Resume(): the owner first takes its memory back to what is on disk.
class AnnotationStore {
 public:
  struct Options {
    std::size_t max_queued = 4096;
    /// Largest size of the file; 0: none. Reaching it is reported like a full disk.
    std::int64_t max_bytes = 0;
  };
  /// Called once per change on the commit thread: OK once it is on disk.
  using Done = std::function<void(const absl::Status&)>;

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

  /// Commits what is queued, then closes.
  ~AnnotationStore();

  /// All that is on disk. DataLoss names the row that cannot be read.
  absl::StatusOr<StoredAnnotations> LoadAll();

  /// Queues a change; never blocks on the disk. `done` is not called if this fails:
  ///   ResourceExhausted   queue full
  ///   the last error      a commit failed and Resume() has not been called yet
  absl::Status Submit(AnnotationChange change, Done done);

  /// Sequence number of the last change on disk; 0 if none in this run. Any thread.
  std::uint64_t committed_sequence() const;
  /// The error of a failed commit until Resume(); OK otherwise. Any thread.
  absl::Status failure() const;
  void Resume();

  /// As Submit, without a change: `done` is called once all that was queued before is on disk, or
  /// with the error that hit it.
  absl::Status SubmitBarrier(Done done);

  /// Waits until all that was queued before is committed or has failed; DeadlineExceeded after
  /// `limit`. Any thread.
  absl::Status Flush(std::chrono::milliseconds limit = std::chrono::hours(1));

 private:
  class Impl;
  explicit AnnotationStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
