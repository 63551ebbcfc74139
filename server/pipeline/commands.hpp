#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "shared/scene/annotation.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

struct StoredMap;

/// Answer to a command. Called exactly once, on any thread; must not block.
template <typename Result>
using Done = std::function<void(absl::StatusOr<Result>)>;
using DoneEmpty = std::function<void(absl::Status)>;

// What may be asked of the tracker thread, and by whom.
struct CreateAnnotation {
  Editor editor;
  AnnotationDraft draft;
  Done<Annotation> done;  // after the commit
};
struct UpdateAnnotation {
  Editor editor;
  AnnotationPatch patch;
  Done<Annotation> done;
};
struct DeleteAnnotation {
  Editor editor;
  std::string id;
  DoneEmpty done;
};
/// Ticks a line of a check list off, or on again.
struct TickItem {
  Editor editor;
  std::string id;
  std::uint32_t index = 0;
  bool ticked = false;
  Done<Annotation> done;
};
struct UndoChange {
  Editor editor;
  bool redo = false;
  Done<std::string> done;  // what was undone, in words
};
struct ResetMap {
  Done<std::uint64_t> done;  // the new map_generation
};
/// A map that outlives the run, and whose coordinates it has.
struct StoredWorld {
  std::shared_ptr<const StoredMap> map;                      // never null
  std::string world;                                         // UUID
  std::shared_ptr<const SurfaceSnapshot> surface = nullptr;  // null: none is known
};
struct StoreMap {
  Done<StoredWorld> done;  // FailedPrecondition: too little is mapped yet
};
struct ResumeMap {
  StoredWorld stored;
  DoneEmpty done;  // once it is looked for
};
/// The person cannot come back: what they did can no longer be undone, and its history is dropped.
struct ForgetPerson {
  std::string person_id;
  DoneEmpty done = [](const absl::Status&) {};
};

using Command = std::variant<CreateAnnotation, UpdateAnnotation, DeleteAnnotation, TickItem,
                             UndoChange, ResetMap, StoreMap, ResumeMap, ForgetPerson>;

/// Answers a command that will not be carried out.
void Fail(const Command& command, const absl::Status& status);

/// Where commands go: the tracker thread's bounded mailbox, on this machine or another.
class CommandPort {
 public:
  virtual ~CommandPort() = default;
  /// Never blocks. On error (ResourceExhausted, Unavailable) `done` is not called.
  virtual absl::Status Submit(Command command) = 0;
};

}  // namespace saccade
