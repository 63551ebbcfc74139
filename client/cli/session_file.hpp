#pragma once

#include <string>

namespace saccade::cli {

/// Where the session with one server under one name is kept between two runs of the program, so
/// that `annotations undo` knows whose last change it takes back: $XDG_STATE_HOME/saccade, else
/// ~/.local/state/saccade. Another name, server or user of this computer is another file. Empty if
/// neither is known.
std::string SessionFilePath(const std::string& server, const std::string& name);

/// The session id kept for them; empty if there is none. A file that others may read or that is
/// somebody else's is none: a session id is a credential.
std::string LoadSession(const std::string& server, const std::string& name);

/// Keeps `session_id`, in a file that is this user's alone (0600). A place that cannot be written
/// costs only undo, so it is no error.
void SaveSession(const std::string& server, const std::string& name, const std::string& session_id);

}  // namespace saccade::cli
