#include "client/session/chat_book.hpp"

#include <algorithm>
#include <utility>

namespace saccade::session {

void ChatBook::Add(const std::vector<net::ChatMessage>& messages) {
  for (const net::ChatMessage& message : messages) {
    const auto at = std::lower_bound(
        messages_.begin(), messages_.end(), message.number,
        [](const net::ChatMessage& each, std::uint64_t number) { return each.number < number; });
    if (at == messages_.end() || at->number != message.number) messages_.insert(at, message);
  }
  if (messages_.size() > kKept) messages_.erase(messages_.begin(), messages_.end() - kKept);
}

void ChatBook::History(const std::vector<net::ChatMessage>& kept) {
  const std::uint64_t last = kept.empty() ? 0 : kept.back().number;
  if (!messages_.empty() && last < messages_.back().number) {
    messages_.clear();
    read_ = 0;
  }
  Add(kept);
  if (!std::exchange(began_, true)) read_ = last;
}

void ChatBook::MarkRead() {
  if (!messages_.empty()) read_ = messages_.back().number;
}

std::size_t ChatBook::Unread(const std::string& my_participant_id) const {
  return static_cast<std::size_t>(
      std::count_if(messages_.begin(), messages_.end(), [&](const net::ChatMessage& message) {
        return message.number > read_ && message.participant_id != my_participant_id;
      }));
}

}  // namespace saccade::session
