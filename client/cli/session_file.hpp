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

/// Beside it, the key that makes all sessions under one name with one server one person's: what
/// they did can be undone in the next, too.
std::string PersonFilePath(const std::string& server, const std::string& name);

/// That key, made anew (256 bits) where there is none or others may read it; in a file that is this
/// user's alone (0600). Empty where it cannot be kept: then each session is a new person.
std::string PersonKey(const std::string& server, const std::string& name);

}  // namespace saccade::cli
