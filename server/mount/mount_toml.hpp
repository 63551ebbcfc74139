#pragma once

#include <string>

#include "server/mount/mount_options.hpp"

namespace saccade {

/// The [mount_model] table that LoadToml reads back to the same options (to 1e-9).
std::string ToToml(const MountOptions& options);

}  // namespace saccade
