#include "server/rpc/chat_book.hpp"

#include <algorithm>

namespace saccade {

ChatLog::const_iterator After(const ChatLog& log, std::uint64_t number) {
  return std::partition_point(log.begin(), log.end(), [number](const auto& message) {
    return message->number() <= number;
  });
}

std::shared_ptr<const v1::ChatMessage> ChatBook::Say(v1::ChatMessage message,
                                                     const std::string& request_id) {
  const std::lock_guard lock(mutex_);
  const std::pair request(message.participant_id(), request_id);
  const auto before = std::find(requests_.begin(), requests_.end(), request);
  if (!request_id.empty() && before != requests_.end()) {
    return (*log_)[static_cast<std::size_t>(before - requests_.begin())];
  }
  message.set_number(++last_number_);
  auto next = std::make_shared<ChatLog>(*log_);
  next->push_back(std::make_shared<const v1::ChatMessage>(std::move(message)));
  requests_.push_back(request);
  if (next->size() > kKept) {
    next->erase(next->begin());
    requests_.pop_front();
  }
  log_ = next;
  return next->back();
}

std::shared_ptr<const ChatLog> ChatBook::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

}  // namespace saccade
