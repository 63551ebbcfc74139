#pragma once

#include <absl/status/status.h>

#include "client/cli/options.hpp"

namespace saccade::cli {

/// `saccade record`: becomes `saccade-eval record`, which lies beside this program and links the
/// sources. Returns only if that cannot be.
absl::Status RunRecord(const Options& options);

}  // namespace saccade::cli
