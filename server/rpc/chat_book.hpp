#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "saccade/v1/talk.pb.h"

namespace saccade {

/// Messages by rising number, without gaps; immutable.
using ChatLog = std::vector<std::shared_ptr<const v1::ChatMessage>>;

/// The messages of `log` from the first one above `number` on.
ChatLog::const_iterator After(const ChatLog& log, std::uint64_t number);

/// The conversation: its last messages, while the server runs. Thread safe.
class ChatBook {
 public:
  static constexpr std::size_t kKept = 500;

  /// Numbers and keeps `message`. If the same participant said something under that request_id
  /// before (not empty) and it is kept yet, that is returned and nothing is said.
  std::shared_ptr<const v1::ChatMessage> Say(v1::ChatMessage message,
                                             const std::string& request_id);
  /// Never null.
  std::shared_ptr<const ChatLog> log() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const ChatLog> log_ = std::make_shared<const ChatLog>();
  std::deque<std::pair<std::string, std::string>> requests_;  // participant and request_id of each
  std::uint64_t last_number_ = 0;
};

}  // namespace saccade
