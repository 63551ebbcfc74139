#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
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
  std::uint32_t last_pin = 0;                 // the highest number that a pin ever had
};

/// Where changes of annotations are made durable: what AnnotationBook needs of a store
/// (`server/store` has the one on disk).
///
/// If a commit fails, every change queued so far fails with the same error and all further ones are
/// refused until Resume(): the owner first takes its memory back to what is kept.
class AnnotationJournal {
 public:
  /// Called once per change, on any thread: OK once it is kept.
  using Done = std::function<void(const absl::Status&)>;

  /// Commits what is queued, then closes.
  virtual ~AnnotationJournal() = default;

  /// All that is kept. DataLoss names the row that cannot be read.
  virtual absl::StatusOr<StoredAnnotations> LoadAll() = 0;

  /// Queues changes that are kept together or not at all; never blocks. `done` (may be null) is not
  /// called if this fails:
  ///   ResourceExhausted   queue full
  ///   the last error      a commit failed and Resume() has not been called yet
  virtual absl::Status SubmitAll(std::vector<AnnotationChange> changes, Done done) = 0;
  absl::Status Submit(AnnotationChange change, Done done) {
    std::vector<AnnotationChange> changes;
    changes.push_back(std::move(change));
    return SubmitAll(std::move(changes), std::move(done));
  }
  /// As SubmitAll, without a change: `done` is called once all that was queued before is kept, or
  /// with the error that hit it.
  virtual absl::Status SubmitBarrier(Done done) = 0;

  /// Sequence number of the last change that is kept; 0 if none in this run. Any thread.
  virtual std::uint64_t committed_sequence() const = 0;
  /// The error of a failed commit until Resume(); OK otherwise. Any thread.
  virtual absl::Status failure() const = 0;
  virtual void Resume() = 0;

  /// Waits until all that was queued before is committed or has failed; DeadlineExceeded after
  /// `limit`. Any thread.
  virtual absl::Status Flush(std::chrono::milliseconds limit) = 0;
};

}  // namespace saccade
