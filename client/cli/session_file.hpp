#pragma once

#include <string>

namespace saccade::cli {

/// Where the session with one server is kept between two runs of the program, so that `annotations
/// undo` knows whose last change it takes back: $XDG_STATE_HOME/saccade, else
/// ~/.local/state/saccade. Empty if neither is known.
std::string SessionFilePath(const std::string& server);

/// The session id kept for `server`; empty if there is none.
std::string LoadSession(const std::string& server);

/// Keeps `session_id`. A place that cannot be written costs only undo, so it is no error.
void SaveSession(const std::string& server, const std::string& session_id);

}  // namespace saccade::cli
