#pragma once

#include <optional>
#include <string>

#include "server/pipeline/commands.hpp"

namespace saccade {

/// Where the replay of a recording is.
struct ReplayState {
  std::string file;
  bool playing = false;
  double position_s = 0, length_s = 0;  // from its beginning
  double speed = 1.0;
};

/// What is to be different; nothing: stays.
struct ReplayChange {
  std::optional<bool> playing;
  std::optional<double> position_s;  // the picture before it that needs no other
  std::optional<double> speed;       // 0.1 to 16
};

/// A recording that is served as if it were live. Thread safe; nothing blocks.
class ReplayPort {
 public:
  virtual ~ReplayPort() = default;
  virtual ReplayState replay() const = 0;
  /// InvalidArgument names the field; Unavailable: the server is shutting down.
  virtual void Change(const ReplayChange& change, Done<ReplayState> done) = 0;
};

}  // namespace saccade
