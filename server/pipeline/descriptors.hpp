#pragma once

namespace saccade {

/// Takes as many file descriptors as the system lets this process have. To be called once, early.
void RaiseDescriptorLimit();

/// True if a connection that was given descriptor `accepted` should be turned away: the last 64 are
/// for the store, the source and the page's other files, whoever connects. (The system gives the
/// lowest number that is free, so a high number means that all below it are taken.)
bool DescriptorsRunOut(int accepted);

/// Makes the system notice within half a minute that the peer of this TCP socket is gone without a
/// word: probes while nothing is under way, a limit on what is not acknowledged otherwise.
void NoticeDeadPeer(int socket);

}  // namespace saccade
