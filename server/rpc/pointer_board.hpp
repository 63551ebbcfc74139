#pragma once

#include <absl/status/status.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/pipeline/pointers.hpp"
#include "server/rpc/session_table.hpp"

namespace saccade {

/// What one word of a pointer says.
struct PointerWord {
  PointerKind kind = PointerKind::kLaser;
  std::string stroke_id;
  std::uint32_t color_rgba = 0xffffffff;
  std::vector<Eigen::Vector3d> points;  // new ones, in world [m]
  std::optional<StrokeSurface> surface;
  bool released = false;
};

/// The pointers that live: those of the last second. Each participant has at most one of each kind;
/// another stroke_id releases the one before. In memory alone. Thread safe.
class PointerBoard {
 public:
  static constexpr Timestamp kSilence = 1'000'000'000;  // without a word for so long: released
  static constexpr Timestamp kLinger = 1'000'000'000;   // and known for so long, to tell its end
  static constexpr std::size_t kMost = 256;             // pointers at one time

  /// Told of each change, at once; must not block or call back.
  using Tell = std::function<void(std::shared_ptr<const PointerList>)>;
  explicit PointerBoard(Tell tell);
  ~PointerBoard();

  /// The surface of a stroke that lives; nothing: none yet.
  std::optional<StrokeSurface> SurfaceOf(const Session& session,
                                         const std::string& stroke_id) const;

  ///   FailedPrecondition  the stroke was released already
  ///   ResourceExhausted   the stroke is too long, or too many pointers live
  absl::Status Say(const Session& session, PointerWord word, Timestamp now_ns = MonotonicNow());

  /// Releases what is theirs.
  void EndParticipant(const std::string& participant_id);
  void EndAccess(const std::vector<std::string>& access_ids);

  /// Releases the silent and forgets those that are released for long. A thread of its own does so
  /// in time. Returns when there is something to do next; 0: there are none.
  Timestamp Expire(Timestamp now_ns);

 private:
  struct Held {
    LivePointer pointer;
    std::string access_id;
    std::optional<StrokeSurface> surface;
    Timestamp released_ns = 0;
  };
  void Release(Held& held, Timestamp now_ns);
  template <typename Whose>
  void End(Whose whose);
  void Publish();
  void Run(const std::stop_token& stop);

  const Tell tell_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<Held> held_;
  std::uint64_t version_ = 0;
  std::jthread thread_;  // last
};

}  // namespace saccade
