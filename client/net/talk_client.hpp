#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/net/connection.hpp"

namespace saccade::net {

/// One line of the conversation.
struct ChatMessage {
  std::uint64_t number = 0;
  std::string display_name, text;
  std::string annotation_id;  // empty: it carries no mark
  std::int64_t sent_unix_ns = 0;
};

/// What people say, and the pause of the picture, of one server. Calls block, errors as of
/// Connection.
class TalkClient {
 public:
  explicit TalkClient(const ConnectionOptions& options);
  ~TalkClient();

  /// Joins with the name and role of `options`, going on with its session if that is known yet.
  /// Before every other call.
  absl::Status Join();
  /// Empty before Join().
  const std::string& session_id() const;

  /// Says it once, also if the call is made again.
  absl::StatusOr<ChatMessage> Say(const std::string& text, const std::string& annotation_id);
  /// What is kept, oldest first.
  absl::StatusOr<std::vector<ChatMessage>> Messages();
  /// What is kept and what follows, until `on_message` returns false (OK) or the server ends it.
  absl::Status Follow(const std::function<bool(const ChatMessage&)>& on_message);
  /// PermissionDenied: only the wearer does that.
  absl::StatusOr<PicturePause> PausePicture(bool paused);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::net
