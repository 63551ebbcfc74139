#pragma once

#include <string>

#include "client/session/gaze_pilot.hpp"
#include "client/session/state.hpp"
#include "client/tools/marks.hpp"

/// The state of things in words, as the page has them. Pure.
namespace saccade::tools {

/// With what to do about it. Never colour alone: `mark` is a shape.
struct StatusWords {
  std::string mark;  // one character
  std::string text;
  std::string advice;
  bool warn = false;
};
StatusWords StatusOf(const session::State& state, Timestamp now_ns);

/// Over the picture of a camera that does not know where it is; empty otherwise.
std::string LostWords(const session::State& state);

/// "Ann paused the picture at 12:03; the map stays live".
std::string PauseWords(const net::PicturePause& pause);
/// "12:03", where this machine is.
std::string ClockWords(std::int64_t unix_ns);

/// "2 experts, 1 wearer".
std::string PresenceWords(const std::vector<net::Participant>& participants);

/// Error of an anchor: "0.8 px · 3 mm", or why it is not to be trusted.
struct AnchorWords {
  std::string text;
  bool warn = false;
};
AnchorWords WordsOf(const Annotation& annotation, const Scale& scale);

/// What the head does, and what is to be done about it.
StatusWords GazeWords(const session::State& state);
/// Who pilots, who waits, and what place in the queue is mine.
std::string SteerWords(const session::State& state, const session::GazePilot& pilot);
/// Few words beside the target's own mark.
std::string TargetLabel(const GazeSnapshot& gaze);
/// "12 deg right, 4 deg up" of the wearer's straight ahead.
std::string DirectionWords(const Eigen::Vector3d& joints_rad);
/// True where there is something to turn.
bool HasHead(const session::State& state);

/// "3.0 mm", "53 cm", "2.3 m".
std::string LengthWords(double metres);
/// "4 s", "3 min".
std::string SpanWords(Timestamp span_ns);

}  // namespace saccade::tools
