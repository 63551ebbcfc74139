#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/net/stream.hpp"
#include "client/session/session.hpp"
#include "shared/audio/voice_devices.hpp"

namespace saccade::talk {

/// ALSA's names of what is spoken into and heard from; empty: none.
struct VoiceOptions {
  std::string microphone = "default";
  std::string loudspeaker = "default";
};

/// The voices of one session: one's own, once joined, and everybody else's. Everything but Hear()
/// is for the thread that draws.
class VoiceRoom {
 public:
  enum class State { kOff, kOpening, kOn };

  /// `wake`: something of it has changed; any thread.
  VoiceRoom(VoiceOptions options, std::function<void()> wake);
  /// After End().
  ~VoiceRoom();

  /// What others say. Any thread.
  void Hear(const net::VoiceNews& news);

  /// Hears the others in this session and, if there is a microphone, is heard.
  void Join(session::Session& session);
  void Leave(session::Session& session);
  /// Leaves, and waits for what is under way, a second at most: the session may go.
  void End(session::Session& session);
  void ToggleMute();
  void TogglePushToTalk();
  /// The key of push to talk.
  void Press(bool pressed);
  /// Once per picture; true if anything that is shown has changed.
  bool Check(session::Session& session, Timestamp now_ns);

  State state() const { return state_; }
  bool muted() const { return muted_; }
  bool push_to_talk() const { return push_to_talk_; }
  bool has_microphone() const { return has_microphone_; }
  /// True while what is said here goes out.
  bool open() const;
  /// Why one is not heard, or hears nothing, with the remedy; empty: nothing is wrong.
  const std::string& problem() const { return problem_; }
  bool Speaks(const std::string& participant_id) const;
  /// What is to be known of all that, in words; empty while off.
  std::string Words() const;

 private:
  class Work;
  void Apply();

  const VoiceOptions options_;
  const std::function<void()> wake_;
  State state_ = State::kOff;
  bool muted_ = false, push_to_talk_ = false, pressed_ = false, has_microphone_ = false;
  std::string problem_;
  std::vector<std::string> speaking_;  // sorted
  std::mutex mutex_;
  std::shared_ptr<Work> work_;       // guarded by mutex_
  std::vector<std::jthread> ended_;  // what was left, until it has ended
  std::jthread thread_;
};

}  // namespace saccade::talk
