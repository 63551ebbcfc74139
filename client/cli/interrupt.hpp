#pragma once

namespace saccade::cli {

/// From here on SIGINT and SIGTERM ask the command to end in order: Interrupted() turns true. If
/// the process is still there 1.5 s later (a server that does not answer, an output that nobody
/// reads), or at a second signal, it ends at once with exit code 130.
void HearInterrupts();
bool Interrupted();

}  // namespace saccade::cli
