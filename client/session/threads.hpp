#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <thread>
#include <vector>

#include "client/session/acknowledger.hpp"
#include "client/session/session.hpp"
#include "client/session/surface_fetcher.hpp"

namespace saccade::session {

/// The threads of a session and what they share. See session.hpp.
class Session::Threads {
 public:
  Threads(SessionOptions options, PictureSink& pictures, std::function<void()> wake);
  ~Threads();

  std::vector<Answer> Take();
  absl::Status Ask(Request request);
  std::optional<net::ConnectionOptions> current() const;
  void Listen(bool listens);
  absl::Status Speak(const std::vector<VoicePacket>& packets);

 private:
  void RunStream(std::stop_token stop);
  /// Why it ended; OK: the server ended it.
  absl::Status RunOnce(std::stop_token stop, bool& was_live);
  absl::Status Enter(std::stop_token stop, net::ConnectionOptions& connection);
  void RunKeeper(std::stop_token stop);
  void Tick();
  void RunEdits(std::stop_token stop);
  /// What was said before.
  void AskForHistory();
  /// True once after Listen() ended the stream.
  bool Renewed();
  /// The files of those that are not here yet.
  void AskForModels(const std::vector<net::ModelFacts>& models);
  void Post(Answer answer);
  void SetLink(Link::Kind kind, std::string reason = "");
  bool SleepFor(std::stop_token stop, std::chrono::milliseconds time);

  const SessionOptions options_;
  PictureSink& pictures_;
  const std::function<void()> wake_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<Answer> inbox_;
  std::deque<Request> requests_;
  std::optional<net::ConnectionOptions> current_;  // of the session joined
  std::shared_ptr<net::Stream> stream_;            // the one that is read
  std::optional<Acknowledger> acknowledger_;
  Timestamp heard_ns_ = 0, pinged_ns_ = 0;
  SurfaceFetcher surfaces_;
  std::set<std::string> models_;  // fetched; the thread of edits
  std::string ended_;             // why we ended the stream ourselves
  bool listens_ = false;
  bool renewed_ = false;  // the stream was ended to ask for something else

  std::jthread streaming_, keeping_, editing_;  // last: they use what stands above
};

}  // namespace saccade::session
