#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/net/types.hpp"

namespace saccade::session {

/// What was said, as far as this client knows. One thread.
class ChatBook {
 public:
  static constexpr std::size_t kKept = 500;

  /// As it comes; what is known already is passed over.
  void Add(const std::vector<net::ChatMessage>& messages);
  /// All that the server keeps. Numbers that fell are another server's: its conversation is
  /// another one.
  void History(const std::vector<net::ChatMessage>& kept);
  /// They have been read up to the newest.
  void MarkRead();

  /// Oldest first.
  const std::vector<net::ChatMessage>& messages() const { return messages_; }
  /// Of others, since the last MarkRead(); what was said before this client came is no news.
  std::size_t Unread(const std::string& my_participant_id) const;

 private:
  std::vector<net::ChatMessage> messages_;
  std::uint64_t read_ = 0;  // number
  bool began_ = false;
};

}  // namespace saccade::session
