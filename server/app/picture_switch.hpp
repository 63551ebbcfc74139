#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/pipeline/commands.hpp"
#include "server/pipeline/events.hpp"
#include "server/pipeline/runner.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// The wearer's large pause: whether pictures may be seen, and which frames never may.
///
/// Frames that are tracked while it is on, or were exposed before it was lifted, are withheld for
/// good: nobody fetches them later, and a click on one is refused, as nobody was shown it. Kept in
/// DIR/picture_pause.json, so that a server that starts again shows nothing until it is lifted.
/// Thread safe.
class PictureSwitch {
 public:
  /// Called on the switch's thread with each new state, before it is answered.
  using OnChange = std::function<void(const std::shared_ptr<const PicturePause>&)>;

  /// `directory` empty: nothing is kept.
  /// DataLoss: the file says neither yes nor no; names it and the remedy.
  static absl::StatusOr<std::unique_ptr<PictureSwitch>> Open(
      const std::filesystem::path& directory);
  ~PictureSwitch() { Stop(); }

  /// Before the first Set.
  void SetOnChange(OnChange on_change) { on_change_ = std::move(on_change); }

  /// Stops pictures at once and then keeps that; lets them go only once that is kept.
  ///   ResourceExhausted, Unavailable  nothing was done
  ///   Internal                        the file cannot be written; pictures are stopped
  void Set(bool paused, std::string by, Done<PicturePause> done);
  void Stop();

  std::shared_ptr<const PicturePause> state() const;
  /// FailedPrecondition says who paused, in words.
  absl::Status MayShow() const;
  /// As MayShow(), and for a frame that is withheld.
  absl::Status MayShow(FrameId id) const;
  /// FailedPrecondition: the frame is withheld. Pictures that were shown before may be clicked.
  absl::Status MayClick(FrameId id) const;

  /// A frame that was tracked; by rising id. `captured_ns`: middle of its exposure,
  /// MonotonicNow()'s clock.
  void Note(FrameId id, Timestamp captured_ns);

 private:
  struct Range {
    FrameId first = 0, last = 0;
  };
  class Answer;
  struct Order {
    bool paused = false;
    std::string by;
    std::shared_ptr<Answer> answer;
  };

  explicit PictureSwitch(std::filesystem::path file, PicturePause state);

  absl::StatusOr<PicturePause> Carry(const Order& order);
  void Change(const PicturePause& state);
  absl::Status Keep(const PicturePause& state) const;
  bool Withheld(FrameId id) const;

  const std::filesystem::path file_;  // empty: nothing is kept
  bool kept_ = true;                  // the switch's thread
  OnChange on_change_ = [](const auto&) {};
  mutable std::mutex mutex_;
  std::shared_ptr<const PicturePause> state_;
  Timestamp lifted_ns_ = 0;  // when it last was
  std::vector<Range> withheld_;
  bool newest_withheld_ = false;
  FrameId newest_ = 0;
  Runner<Order> runner_;  // last
};

}  // namespace saccade
