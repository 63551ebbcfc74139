#include "client/session/session.hpp"

#include <utility>
#include <vector>

#include "client/session/threads.hpp"

namespace saccade::session {

Session::Session(SessionOptions options, PictureSink& pictures, std::function<void()> wake)
    : threads_(std::make_unique<Threads>(std::move(options), pictures, std::move(wake))) {}
Session::~Session() = default;

bool Session::Poll() {
  const std::vector<Answer> answers = threads_->Take();
  for (const Answer& answer : answers) answer(state_);
  return !answers.empty();
}

absl::Status Session::Ask(Request request) {
  if (!state_.link.live()) return absl::UnavailableError("no connection to the server");
  return threads_->Ask(std::move(request));
}

void Session::Listen(bool listens) { threads_->Listen(listens); }

absl::Status Session::Speak(const std::vector<VoicePacket>& packets) {
  return threads_->Speak(packets);
}

std::optional<net::ConnectionOptions> Session::connection() const { return threads_->current(); }

}  // namespace saccade::session
