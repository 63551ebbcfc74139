#include "shared/version/version.hpp"

#include "saccade/commit.hpp"  // made at every build, written when it changes

namespace saccade {

const char* Version() { return SACCADE_VERSION " (" SACCADE_COMMIT ")"; }

}  // namespace saccade
