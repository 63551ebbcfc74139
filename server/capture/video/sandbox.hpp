#pragma once

#include <string>

namespace saccade {

/// Shuts this process in, for good: it dies with its parent, gains no rights, starts no program,
/// opens no file, writes none, and has bounded memory. With `network` it may open sockets (streams
/// come from there), else not even that. Empty, or what could not be done.
std::string EnterSandbox(bool network);

/// Tries what the sandbox must hold off and says what got through, a line each ("open /etc/passwd:
/// allowed" or "...: refused (EPERM)"). For tests and for people who do not believe it.
std::string TrySandbox();

}  // namespace saccade
