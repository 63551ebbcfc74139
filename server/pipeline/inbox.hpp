#pragma once

#include <absl/status/status.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "server/pipeline/busy.hpp"

namespace saccade {

/// What one thread waits for: the newest item (a frame) and a bounded mailbox of commands.
///
/// Items keep the newest: a slow consumer never makes the producer wait, unless the producer asks
/// to (PutWait, for runs that must see every frame). Commands are never lost silently: Submit
/// refuses when the mailbox is full or closed. Any thread may put and submit; one thread calls
/// Wait.
template <typename Item, typename Command>
class Inbox {
 public:
  /// `capacity`: commands that may wait.
  explicit Inbox(std::size_t capacity) : capacity_(capacity) {}

  /// Replaces an item that nobody took yet; true if it did.
  bool PutNewest(Item item) {
    bool replaced = false;
    {
      const std::lock_guard lock(mutex_);
      replaced = item_.has_value();
      item_ = std::move(item);
    }
    changed_.notify_all();
    return replaced;
  }

  /// Puts an item only if none waits.
  void PutNewestIfEmpty(Item item) {
    {
      const std::lock_guard lock(mutex_);
      if (item_.has_value()) return;
      item_ = std::move(item);
    }
    changed_.notify_all();
  }

  /// Waits until the item before was taken. False if `stop` came first.
  bool PutWait(Item item, std::stop_token stop) {
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return !item_.has_value(); })) return false;
      item_ = std::move(item);
    }
    changed_.notify_all();
    return true;
  }

  /// ResourceExhausted: the mailbox is full. Unavailable: closed. `command` is untouched then.
  absl::Status Submit(Command&& command) {
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return absl::UnavailableError("the server is shutting down");
      if (commands_.size() >= capacity_) {
        return BusyError("too many commands are waiting", 200'000'000);
      }
      commands_.push_back(std::move(command));
    }
    changed_.notify_all();
    return absl::OkStatus();
  }

  struct Batch {
    std::optional<Item> item;
    std::vector<Command> commands;
  };

  /// Waits for an item or a command; nothing once `stop` is requested.
  std::optional<Batch> Wait(std::stop_token stop) {
    Batch batch;
    {
      std::unique_lock lock(mutex_);
      const bool ready =
          changed_.wait(lock, stop, [this] { return item_.has_value() || !commands_.empty(); });
      if (!ready || stop.stop_requested()) return std::nullopt;
      batch.item = std::exchange(item_, std::nullopt);
      batch.commands.assign(std::make_move_iterator(commands_.begin()),
                            std::make_move_iterator(commands_.end()));
      commands_.clear();
    }
    changed_.notify_all();
    return batch;
  }

  /// Refuses commands from now on and hands out those that waited, so that each gets an answer.
  std::vector<Command> Close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    std::vector<Command> left(std::make_move_iterator(commands_.begin()),
                              std::make_move_iterator(commands_.end()));
    commands_.clear();
    return left;
  }

 private:
  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Item> item_;
  std::deque<Command> commands_;
  bool closed_ = false;
};

}  // namespace saccade
