#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <vector>

#include "client/net/connection.hpp"
#include "client/net/stream.hpp"
#include "client/session/picture_sink.hpp"
#include "client/session/state.hpp"

namespace saccade::session {

struct SessionOptions {
  net::ConnectionOptions connection;
  /// Before each joining, on a thread of the session: finds token and trust, redeems an invite.
  /// True: one waits to be let in. Empty: nothing to do.
  std::function<absl::StatusOr<bool>(net::ConnectionOptions&)> enter;
  /// What others say, on the thread of the stream. Empty: nobody listens.
  std::function<void(const net::VoiceNews&)> on_voice;
};

/// One person's session with one server: joins, subscribes, joins again when the server went away.
///
/// Three threads of its own (stream; acknowledgements and pings; edits), none of which ever waits
/// for the one that draws. What they learn is brought to it by Poll(). Everything public is for
/// that one thread.
class Session {
 public:
  /// What a call led to, to be done where the state is.
  using Answer = std::function<void(State&)>;
  /// A call, on the thread of edits; in order, one at a time.
  using Request = std::function<Answer(net::Connection&)>;

  /// `pictures` gets coded pictures on other threads, `wake` is called there when Poll() has
  /// something; both outlive the session.
  Session(SessionOptions options, PictureSink& pictures, std::function<void()> wake);
  /// Ends the threads: at once but for a call under way, which may take its deadline.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Brings the state up to date; true if anything came.
  bool Poll();
  const State& state() const { return state_; }
  State& state() { return state_; }

  /// Runs `request` in this session.
  ///   Unavailable        not connected
  ///   ResourceExhausted  64 wait already
  absl::Status Ask(Request request);

  /// Whether voices are asked for: subscribes anew, in the same session.
  void Listen(bool listens);
  /// Says it to the others; blocks for a second at most. Any thread. `capture_ns`: of the server's
  /// clock. Errors as Connection.
  absl::Status Speak(const std::vector<VoicePacket>& packets);

  /// As the calls of this session are made; nothing before it was joined.
  std::optional<net::ConnectionOptions> connection() const;

 private:
  class Threads;
  State state_;
  std::unique_ptr<Threads> threads_;
};

}  // namespace saccade::session
